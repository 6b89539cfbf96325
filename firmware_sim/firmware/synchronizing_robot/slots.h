/* slots.h: round-robin slots on the local clock (Protocol 1), as firmware_sim/schedules/slotted_broadcast.py.
 *
 *     slot k = [start + k slot, start + (k+1) slot), belongs to part k mod T;  round m = slots m T .. m T + T - 1
 *
 *     | guard |  data  | guard |  control  | guard |       without control sub-slots: | guard |  data  | guard |
 *     0       data          control_offset         slot
 *
 * In the control sub-slot of slot k only robot k mod N may send, in cycle floor(k / N). All times are local [ns].
 * "Next" instants are strictly after the given one. */
#ifndef SLOTS_H
#define SLOTS_H

#include <stdint.h>

typedef struct {
    int64_t parts;              /* T */
    int64_t slot_ns;
    int64_t start_ns;
    int64_t guard_ns;
    int64_t robots;             /* N, owners of control sub-slots; 0: no control sub-slots */
    int64_t control_offset_ns;  /* start of the control transmission within its slot */
} Slots;

int64_t slots_round_ns(const Slots *slots);

/* Number of the slot that contains `local_ns`; negative before the start. */
int64_t slots_at(const Slots *slots, int64_t local_ns);

/* Instant at which the part of slot `number` begins to send. */
int64_t slots_data_ns(const Slots *slots, int64_t number);

/* First slot of `part` after slot `after_slot` that begins to send after `local_ns`. */
int64_t slots_next_of(const Slots *slots, int64_t part, int64_t local_ns, int64_t after_slot);

/* Slot of `part` whose sending instant is nearest to `sent_ns`, the earlier one of two. */
int64_t slots_nearest_of(const Slots *slots, int64_t part, int64_t sent_ns);

/* Instant at which the owner of the control sub-slot of slot `number` begins to send. */
int64_t slots_control_ns(const Slots *slots, int64_t number);

/* First slot after `after_slot` whose control sub-slot is `robot`'s and begins after `local_ns`. */
int64_t slots_next_control_of(const Slots *slots, int64_t robot, int64_t local_ns, int64_t after_slot);

/* First end of a complete round after `local_ns`; the start counts as one. */
int64_t slots_round_end_after(const Slots *slots, int64_t local_ns);

#endif
