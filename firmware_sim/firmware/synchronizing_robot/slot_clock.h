/* slot_clock.h: resynchronization of the slot clock from the frames that arrive, and the watch over it.
 *
 *     x_i <- x_i - clip(gain * mean_{j heard} (x_i - x_j), bound)          x_i: offset of clock i
 *
 * As firmware_sim/slot_sync.py (steps alone, no rate) and agents/synchronization/in_step.py. A clock is out of step if
 * it is further from the mean of those heard than `far_ns`; then a step has no bound. The mean of whole numbers is
 * their exact sum, divided once. */
#ifndef SLOT_CLOCK_H
#define SLOT_CLOCK_H

#include "team.h"

typedef struct {
    int64_t bound_ns, far_ns;
    double gain, contraction;
    Robots heard;
    int64_t error_ns[MAX_ROBOTS];   /* lead of this robot's clock over the sender's */
    int64_t rounds;                 /* since the clock is out of step, 0 while it is in step */
    double largest_ns;              /* error since then */
} SlotClock;

void slot_clock_init(SlotClock *clock, const Team *team);

/* Note the arrival of a frame, in local time; of several the earliest one counts. */
void slot_clock_heard(SlotClock *clock, const Team *team, uint32_t sender, int64_t expected_ns, int64_t arrived_ns);

/* Report whether the clock is in step, correct it and drop the errors of this round. */
void slot_clock_close_round(SlotClock *clock);

#endif
