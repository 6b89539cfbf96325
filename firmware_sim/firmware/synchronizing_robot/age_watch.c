/* age_watch.c: see age_watch.h. */
#include "age_watch.h"
#include <string.h>
#include "marconet_numbers.h"

void age_watch_init(AgeWatch *watch, const Team *team)
{
    watch->oldest_ns = team->oldest_value_ns;
    watch->tolerance_ns = team->guard_ns;       /* largest difference of two robots' clocks */
    watch->eras = 0;
    watch->reported = 0;
}

void age_watch_retire(AgeWatch *watch, const Slots *slots, const uint8_t *part, int64_t from_ns, int64_t until_ns)
{
    const uint32_t kept = watch->eras < REMEMBERED ? watch->eras : REMEMBERED - 1;
    memmove(watch->era + 1, watch->era, kept * sizeof watch->era[0]);
    watch->eras = kept + 1;
    watch->era[0].slots = *slots;
    memcpy(watch->era[0].part, part, sizeof watch->era[0].part);
    watch->era[0].from_ns = from_ns;
    watch->era[0].until_ns = until_ns;
}

void age_watch_forget(AgeWatch *watch) { watch->eras = 0; }

static bool fits(const AgeWatch *watch, uint32_t sender, int64_t slot, int64_t now_ns, const Slots *slots,
                 const uint8_t *part, int64_t from_ns, int64_t until_ns, int64_t *age_ns)
{
    const int64_t sent_ns = slots_data_ns(slots, slot);
    *age_ns = now_ns - sent_ns;
    return floor_mod(slot, slots->parts) == part[sender] && *age_ns >= -watch->tolerance_ns
           && from_ns - watch->tolerance_ns <= sent_ns && sent_ns < until_ns
           && (watch->oldest_ns < 0 || *age_ns <= watch->oldest_ns + watch->tolerance_ns);
}

bool age_watch_age(const AgeWatch *watch, uint32_t sender, int64_t slot, int64_t now_ns, const Slots *slots,
                   const uint8_t *part, int64_t from_ns, int64_t *age_ns)
{
    if (fits(watch, sender, slot, now_ns, slots, part, from_ns, now_ns + watch->tolerance_ns + 1, age_ns)) {
        return true;
    }
    for (uint32_t k = 0; k < watch->eras; k++) {
        const Era *era = watch->era + k;
        if (fits(watch, sender, slot, now_ns, &era->slots, era->part, era->from_ns, era->until_ns, age_ns)) {
            return true;
        }
    }
    return false;
}

bool age_watch_is_news(AgeWatch *watch, uint32_t sender, int64_t age_ns)
{
    if (HAS(watch->reported, sender) && age_ns < 2 * watch->reported_ns[sender]) {
        return false;
    }
    watch->reported = (Robots)(watch->reported | ONLY(sender));
    watch->reported_ns[sender] = age_ns;
    return true;
}
