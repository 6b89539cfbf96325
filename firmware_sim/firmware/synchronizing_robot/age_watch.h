/* age_watch.h: the age of the values that a robot receives, as agents/synchronization/age_watch.py.
 *
 *     age = time of arrival - sending instant of the slot whose number the frame bears, both by the receiver's clock
 *
 * Slot numbers begin anew with each topology, so the frame's slot is searched in the schedule in force and then in the
 * earlier ones, the latest first. A slot fits if it belonged to the sender, lay within the time in which its schedule
 * was in force, and gives an age that the links can cause. */
#ifndef AGE_WATCH_H
#define AGE_WATCH_H

#include "slots.h"
#include "team.h"

enum { REMEMBERED = 32 };       /* number of earlier schedules kept */

typedef struct {
    Slots slots;
    uint8_t part[MAX_ROBOTS];
    int64_t from_ns, until_ns;  /* local time; a slot that begins at `until_ns` belongs to the next schedule */
} Era;

typedef struct {
    int64_t oldest_ns, tolerance_ns;
    uint32_t eras;
    Era era[REMEMBERED];        /* the latest first */
    int64_t reported_ns[MAX_ROBOTS];
    Robots reported;
} AgeWatch;

void age_watch_init(AgeWatch *watch, const Team *team);

/* Keep a schedule that was in force over [from_ns, until_ns). */
void age_watch_retire(AgeWatch *watch, const Slots *slots, const uint8_t *part, int64_t from_ns, int64_t until_ns);

void age_watch_forget(AgeWatch *watch);

/* Find the age [ns] of a value; false if no schedule fits. */
bool age_watch_age(const AgeWatch *watch, uint32_t sender, int64_t slot, int64_t now_ns, const Slots *slots,
                   const uint8_t *part, int64_t from_ns, int64_t *age_ns);

/* Whether to report this age: the sender's first that is too old, or twice the one reported last. */
bool age_watch_is_news(AgeWatch *watch, uint32_t sender, int64_t age_ns);

#endif
