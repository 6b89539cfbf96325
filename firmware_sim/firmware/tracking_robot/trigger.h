/* trigger.h: input-output triggering: from a measurement, how long its command may be held. As agents/triggering.
 *
 *     gamma_e(tau) = (exp(a tau) - 1) / a                                  a = ||A|| over [0, tau]      (4.28)
 *     tau* = ln(kappa a / gamma_n + 1) / a:  gamma_n gamma_e(tau*) = kappa < 1                         (4.37)
 *
 * gamma_n is the gain of the inputs measured now, from the table of planned inputs, or the largest gain Z of all inputs
 * (Assumption 2). tau_i is the largest tau with tau <= tau*(a(tau)), found from below. With N^D losses allowed a look is
 * asked for every tau_i / (N^D + 1) (Remark 6). */
#ifndef TRIGGER_H
#define TRIGGER_H

#include <stdbool.h>
#include <stdint.h>
#include "controller.h"

typedef enum { INDIVIDUAL_GAINS, UNIFIED_GAIN, PERIODIC } Policy;       /* choices of the parameter `policy` */

typedef struct {
    int64_t measured_ns;        /* t_i */
    int64_t interval_ns;        /* from t_i to the next request, and between requests without an answer */
    int64_t valid_ns;           /* tau_i: certified over [t_i, t_i + tau_i] */
    double gain_per_s;          /* gamma_n */
    double growth_per_s;        /* ||A||, valid over [t_i, t_i + tau_i] */
} Decision;

typedef struct {
    Policy policy;
    Gains gains;                /* of the controller */
    Velocities limits;          /* P: the largest |v_R2|, |omega_R2| */
    double unified_gain;        /* Z [1/s] */
    double noise, kappa;
    int64_t losses_allowed;     /* N^D */
    Decision periodic;          /* of the policy PERIODIC, without its instant */
} Trigger;

void trigger_init(Trigger *trigger);

/* Decide from `x`, measured at `measured_ns`, and the inputs known with it; return false if x is no tracking error. */
bool trigger_decide(const Trigger *trigger, int64_t measured_ns, TrackingError x, Velocities inputs, Decision *decision);

/* Return whether the table has a gain for the inputs, and the gain [1/s]: its entry, or Z. */
bool trigger_gain(const Trigger *trigger, Velocities inputs, double *gain_per_s);

/* Return tau* [s] of (4.37). */
double horizon_s(double growth_per_s, double gain_per_s, double kappa);

/* --- a decision */

/* Return gamma_n gamma_e(now - t_i): at most kappa while the decision holds; Theorem 4 requires < 1. */
double decision_gain_product(const Decision *decision, int64_t now_ns);

/* Return how many requests in a row may fail if the next one still arrives within tau_i. */
int64_t decision_losses_allowed(const Decision *decision);

/* Return when to send the next request after `failed` requests without an answer. */
int64_t decision_attempt_ns(const Decision *decision, int64_t failed);

#endif
