/* slots.c: Protocol 1, see slots.h. */
#include "slots.h"
#include "marconet_numbers.h"

/* Smallest k >= 0 with start + k slot + offset > local. */
static int64_t first_after(const Slots *slots, int64_t local_ns, int64_t offset_ns)
{
    return larger(0, floor_div(local_ns - slots->start_ns - offset_ns, slots->slot_ns) + 1);
}

int64_t slots_round_ns(const Slots *slots) { return slots->parts * slots->slot_ns; }

int64_t slots_at(const Slots *slots, int64_t local_ns)
{
    return floor_div(local_ns - slots->start_ns, slots->slot_ns);
}

int64_t slots_data_ns(const Slots *slots, int64_t number)
{
    return slots->start_ns + number * slots->slot_ns + slots->guard_ns;
}

int64_t slots_next_of(const Slots *slots, int64_t part, int64_t local_ns, int64_t after_slot)
{
    const int64_t earliest = larger(first_after(slots, local_ns, slots->guard_ns), after_slot + 1);
    return earliest + floor_mod(part - earliest, slots->parts);
}

int64_t slots_nearest_of(const Slots *slots, int64_t part, int64_t sent_ns)
{
    const int64_t round_ns = slots_round_ns(slots);
    const int64_t rounds = floor_div(sent_ns - slots_data_ns(slots, part) + (round_ns - 1) / 2, round_ns);
    return larger(0, rounds) * slots->parts + part;
}

int64_t slots_control_ns(const Slots *slots, int64_t number)
{
    return slots->start_ns + number * slots->slot_ns + slots->control_offset_ns;
}

int64_t slots_next_control_of(const Slots *slots, int64_t robot, int64_t local_ns, int64_t after_slot)
{
    const int64_t earliest = larger(first_after(slots, local_ns, slots->control_offset_ns), after_slot + 1);
    return earliest + floor_mod(robot - earliest, slots->robots);
}

int64_t slots_round_end_after(const Slots *slots, int64_t local_ns)
{
    const int64_t round_ns = slots_round_ns(slots);
    return slots->start_ns + larger(0, floor_div(local_ns - slots->start_ns, round_ns) + 1) * round_ns;
}
