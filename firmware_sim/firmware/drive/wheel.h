/* wheel.h: encoder and speed loop of one wheel, as wheel_encoder.py and speed_loop.py of firmware_sim/drive_controller.
 *
 *     count = floor(angle / 2 pi counts_per_turn), as a 32-bit counter that wraps
 *     speed = 2 pi / counts_per_turn (count - last count) / elapsed
 *
 *     error = reference - measured         command = feedforward reference + kp error + integral, |command| <= limit
 *     integral += ki error dt              unless the command is at its limit and the error has the same sign
 *
 * Not modelled: a lag of the wheel that the loop assumes; it needs an exponential function. */
#ifndef WHEEL_H
#define WHEEL_H

#include <stdint.h>

typedef struct {
    double kp, ki, feedforward;     /* ki in 1/s */
    double limit_radps;
    double counts_per_turn;
} WheelSettings;

typedef struct {
    int32_t count;
    double speed_radps;
    double integral_radps;
} Wheel;

/* Take a reading without a speed: the first one, or one at an unknown time after the last. */
void wheel_restart(Wheel *wheel, const WheelSettings *settings, double angle_rad);

/* Take a reading; `elapsed_ns` > 0 is the local time since the last one. */
void wheel_read(Wheel *wheel, const WheelSettings *settings, double angle_rad, int64_t elapsed_ns);

/* Return the command [rad/s] for the next period. */
double wheel_command(Wheel *wheel, const WheelSettings *settings, double reference_radps, int64_t elapsed_ns);

#endif
