/* wheel.c: see wheel.h. */
#include "wheel.h"

static const double PI = 3.141592653589793;

static int32_t counter(const WheelSettings *settings, double angle_rad)
{
    const double counts = angle_rad / (2.0 * PI) * settings->counts_per_turn;
    const int64_t below = (int64_t)counts - (counts < (double)(int64_t)counts ? 1 : 0);
    return (int32_t)(uint32_t)(uint64_t)below;
}

void wheel_restart(Wheel *wheel, const WheelSettings *settings, double angle_rad)
{
    wheel->count = counter(settings, angle_rad);
}

void wheel_read(Wheel *wheel, const WheelSettings *settings, double angle_rad, int64_t elapsed_ns)
{
    const int32_t before = wheel->count;
    wheel->count = counter(settings, angle_rad);
    const int32_t counted = (int32_t)((uint32_t)wheel->count - (uint32_t)before);
    wheel->speed_radps = 2.0 * PI / settings->counts_per_turn * (double)counted / ((double)elapsed_ns / 1e9);
}

double wheel_command(Wheel *wheel, const WheelSettings *settings, double reference_radps, int64_t elapsed_ns)
{
    const double limit = settings->limit_radps;
    const double error = reference_radps - wheel->speed_radps;
    const double integral = wheel->integral_radps + settings->ki * error * (double)elapsed_ns / 1e9;
    double wanted = settings->feedforward * reference_radps + settings->kp * error + integral;
    const double size = wanted < 0.0 ? -wanted : wanted;
    if (!(size > limit && wanted * error > 0.0)) {
        wheel->integral_radps = integral;
    } else {
        wanted = settings->feedforward * reference_radps + settings->kp * error + wheel->integral_radps;
    }
    return wanted > limit ? limit : wanted < -limit ? -limit : wanted;
}
