/* trigger.c: see trigger.h. */
#include "trigger.h"
#include "board_ids.h"
#include "error_bound.h"
#include "marconet_board.h"
#include "marconet_functions.h"
#include "marconet_numbers.h"
#include "reachable_set.h"

static const double FAR = 1e6;                  /* a larger tracking error is refused as a broken measurement */
static const double SAME_INPUTS = 1e-6;
static const double SETTLED = 1e-5;             /* accuracy of a horizon, as a share of kappa / gamma_n */
static const double LARGEST_EXPONENT = 700.0;
static const double TINY_PER_S = 1e-9;          /* growth below which gamma_e(tau) = tau */

typedef struct {
    Start start;
    double v;                   /* of the inputs whose matrix A counts */
} Prediction;

static double number(uint32_t parameter, uint32_t index)
{
    double value = 0.0;
    board_parameter(parameter, index, &value);
    return value;
}

void trigger_init(Trigger *trigger)
{
    const Gains gains = { number(PARAMETER_K, 0), number(PARAMETER_K, 1), number(PARAMETER_K, 2) };
    const Velocities limits = { number(PARAMETER_LIMITS, 0), number(PARAMETER_LIMITS, 1) };
    const int64_t period_ns = (int64_t)number(PARAMETER_CERTIFIED_NS, 0);
    trigger->policy = (Policy)number(PARAMETER_POLICY, 0);
    trigger->gains = gains;
    trigger->limits = limits;
    trigger->unified_gain = number(PARAMETER_LARGEST_GAIN, 0);
    trigger->noise = number(PARAMETER_NOISE_BOUND, 0);
    trigger->kappa = number(PARAMETER_KAPPA, 0);
    trigger->losses_allowed = (int64_t)number(PARAMETER_MAX_SUCCESSIVE_LOSSES, 0);
    const Decision periodic = { 0, period_ns, period_ns, trigger->unified_gain, number(PARAMETER_CERTIFIED_GROWTH, 0) };
    trigger->periodic = periodic;
    error_bound_init(&gains);
}

/* --- gains */

static bool same(double a, double b, double within) { return magnitude(a - b) <= within; }

bool trigger_gain(const Trigger *trigger, Velocities inputs, double *gain_per_s)
{
    const uint32_t rows = (uint32_t)board_parameter_length(PARAMETER_PLANNED_GAINS) / 3u;
    const double within[] = { 0.0, SAME_INPUTS };               /* an exact match precedes a near one */
    for (uint32_t pass = 0; pass < 2; pass++) {
        for (uint32_t row = 0; row < rows; row++) {
            if (same(number(PARAMETER_PLANNED_GAINS, 3 * row), inputs.v, within[pass])
                && same(number(PARAMETER_PLANNED_GAINS, 3 * row + 1), inputs.omega, within[pass])) {
                *gain_per_s = number(PARAMETER_PLANNED_GAINS, 3 * row + 2);
                return true;
            }
        }
    }
    *gain_per_s = trigger->unified_gain;
    return false;
}

static double error_gain(double growth, double tau)
{
    if (growth * tau > LARGEST_EXPONENT) {
        return from_bits(0x7FF0000000000000u);         /* infinity */
    }
    return growth <= TINY_PER_S ? tau : exp_m1(growth * tau) / growth;
}

/* --- horizons */

double horizon_s(double growth, double gain, double kappa)
{
    return growth <= TINY_PER_S ? kappa / gain : log_1p(kappa * growth / gain) / growth;
}

static double growth_until(const Prediction *prediction, double tau)
{
    return growth_per_s(prediction->v, extents_until(&prediction->start, tau));
}

/* Return the largest tau with tau <= tau*(a(tau)), and a(tau), as `largest_horizon` of error_gain.py. a does not
 * decrease, so for a tau that is too long tau*(a(tau)) is safe, and for a safe tau it is too long. */
static double largest_horizon(const Prediction *prediction, double gain, double kappa, double *growth)
{
    double high = kappa / gain;
    const double settled = SETTLED * high;
    double low = horizon_s(growth_until(prediction, high), gain, kappa);
    for (;;) {
        const double width = high - low;
        *growth = growth_until(prediction, low);
        const double longest = horizon_s(*growth, gain, kappa);
        high = longest < high ? longest : high;
        if (!(high - low > settled)) {
            return low;
        }
        const double tried = 2.0 * (high - low) < width ? high : (low + high) / 2.0;
        const double allowed = horizon_s(growth_until(prediction, tried), gain, kappa);
        if (allowed < tried) {
            high = tried;
        }
        const double safe = allowed < tried ? allowed : tried;
        low = safe > low ? safe : low;
    }
}

/* --- decisions */

static double clipped(double value, double most) { return value > most ? most : value < -most ? -most : value; }

static int64_t smaller(int64_t a, int64_t b) { return a < b ? a : b; }

bool trigger_decide(const Trigger *trigger, int64_t measured_ns, TrackingError x, Velocities inputs, Decision *decision)
{
    if (!(magnitude(x.x1) < FAR && magnitude(x.x2) < FAR && magnitude(x.x3) < FAR)) {
        return false;
    }
    *decision = trigger->periodic;
    if (trigger->policy != PERIODIC) {
        const bool unified = trigger->policy == UNIFIED_GAIN;
        const Velocities known = { clipped(inputs.v, trigger->limits.v), clipped(inputs.omega, trigger->limits.omega) };
        const Prediction prediction = { { x, control(&trigger->gains, x, known), trigger->limits, trigger->noise },
                                        unified ? trigger->limits.v : known.v };
        if (unified) {
            decision->gain_per_s = trigger->unified_gain;
        } else {
            trigger_gain(trigger, known, &decision->gain_per_s);
        }
        const double tau = largest_horizon(&prediction, decision->gain_per_s, trigger->kappa, &decision->growth_per_s);
        decision->valid_ns = decision->interval_ns = larger((int64_t)(tau * 1e9), 1);
    }
    decision->measured_ns = measured_ns;
    if (trigger->losses_allowed > 0) {
        const int64_t shared_ns = decision->valid_ns / (trigger->losses_allowed + 1);
        decision->interval_ns = larger(smaller(decision->interval_ns, shared_ns), 1);
    }
    return true;
}

double decision_gain_product(const Decision *decision, int64_t now_ns)
{
    return decision->gain_per_s
           * error_gain(decision->growth_per_s, (double)larger(now_ns - decision->measured_ns, 0) * 1e-9);
}

int64_t decision_losses_allowed(const Decision *decision) { return decision->valid_ns / decision->interval_ns - 1; }

int64_t decision_attempt_ns(const Decision *decision, int64_t failed)
{
    return decision->measured_ns + (failed + 1) * decision->interval_ns;
}
