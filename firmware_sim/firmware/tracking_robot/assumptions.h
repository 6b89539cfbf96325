/* assumptions.h: which assumptions of the trigger have failed, as agents/triggering/assumptions.py and
 * agents/tracking/assumption_watch.py.
 *
 *     holds  --fails--> broken: counted, "assumption violated"  --holds--> "assumptions hold again"
 *
 *     FRESH         age of the measurement in force <= tau_i                        (4.37)
 *     SMALL_GAIN    gamma_n gamma_e(age) < 1                                        Theorem 4
 *     LOSSES        no more requests in a row failed than fit into tau_i            Remark 6
 *     INPUTS        the inputs of R2 lie in P                                       Theorem 4 (i)
 *     ANNOUNCED     inputs change only at instants that are transmitted at          Assumption 1
 *     GAIN          the gain of these inputs is known, not just bounded by Z        section 4.6
 *     RADIUS        |x| is within what was certified                                Remark 4; periodic measurements */
#ifndef ASSUMPTIONS_H
#define ASSUMPTIONS_H

#include <stdbool.h>
#include <stdint.h>
#include "trigger.h"

/* In the order of their names in events. */
typedef enum { FRESH, ANNOUNCED, GAIN, INPUTS, SMALL_GAIN, LOSSES, RADIUS, ASSUMPTIONS } Assumption;

typedef struct {
    const Trigger *trigger;
    double radius;              /* certified |x|, with the noise of a measurement */
    uint32_t broken;            /* bit k: assumption k */
} Assumptions;

void assumptions_init(Assumptions *watch, const Trigger *trigger, double radius, double noise);

/* Record what fails at `now_ns` of the decision in force, after `failed` requests in a row without an answer. */
void assumptions_check(Assumptions *watch, const Decision *in_force, int64_t now_ns, int64_t failed);

/* Record what a measurement shows; `before` are the inputs received before it, NULL if there were none. */
void assumptions_judge(Assumptions *watch, TrackingError x, Velocities inputs, const Velocities *before);

/* Record that the decision in force is in time: FRESH, SMALL_GAIN and LOSSES hold. */
void assumptions_in_time(Assumptions *watch);

#endif
