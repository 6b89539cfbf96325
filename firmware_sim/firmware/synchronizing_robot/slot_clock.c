/* slot_clock.c: see slot_clock.h. */
#include "slot_clock.h"
#include <stddef.h>
#include "board_ids.h"
#include "marconet_board.h"
#include "marconet_numbers.h"
#include "text.h"

static double size(double value) { return value < 0.0 ? -value : value; }

void slot_clock_init(SlotClock *clock, const Team *team)
{
    clock->bound_ns = larger(1, team->guard_ns / 2);
    clock->far_ns = 2 * team->guard_ns;
    clock->gain = team->sync_gain;
    clock->contraction = team->sync_contraction;
    clock->heard = 0;
    clock->rounds = 0;
    clock->largest_ns = 0.0;
}

void slot_clock_heard(SlotClock *clock, const Team *team, uint32_t sender, int64_t expected_ns, int64_t arrived_ns)
{
    const int64_t error_ns = arrived_ns - team->data_airtime_ns - team->latency_ns - expected_ns;
    if (!HAS(clock->heard, sender) || error_ns < clock->error_ns[sender]) {
        clock->error_ns[sender] = error_ns;
    }
    clock->heard = (Robots)(clock->heard | ONLY(sender));
}

/* Twice the rounds in which an error of the largest size shrinks to far_ns; 0 if that is not known.
 * Differs from in_step.py: rounds are counted by multiplication, not by logarithms, which differ between platforms. */
static int64_t rounds_allowed(const SlotClock *clock)
{
    enum { MOST = 100000 };
    if (!(clock->contraction > 0.0 && clock->contraction < 1.0) || clock->largest_ns <= (double)clock->far_ns) {
        return clock->contraction != 0.0 ? 2 : 0;
    }
    int64_t rounds = 0;
    for (double error_ns = clock->largest_ns; error_ns > (double)clock->far_ns && rounds < MOST; rounds++) {
        error_ns *= clock->contraction;
    }
    return 2 * larger(1, rounds);
}

static void report(SlotClock *clock, double error_ns)
{
    Text text;
    text_begin(&text);
    if (size(error_ns) >= (double)clock->far_ns && clock->far_ns > 0) {
        if (clock->rounds == 0) {
            text_add(&text, "it is ");
            text_number(&text, rounded(error_ns));
            text_add(&text, " ns ahead of those that it hears: expected less than ");
            text_number(&text, clock->far_ns);
            text_add(&text, " ns");
            board_event(EVENT_CLOCK_OUT_OF_STEP, text.letters);
        }
        clock->largest_ns = size(error_ns) > clock->largest_ns ? size(error_ns) : clock->largest_ns;
    } else if (clock->rounds == 0) {
        return;
    } else if (clock->heard != 0) {
        text_add(&text, "after ");
        text_number(&text, clock->rounds);
        text_add(&text, " rounds");
        board_event(EVENT_CLOCK_IN_STEP_AGAIN, text.letters);
        clock->rounds = 0;
        clock->largest_ns = 0.0;
        return;
    }
    clock->rounds++;
    const int64_t allowed = rounds_allowed(clock);
    if (clock->rounds == allowed + 1) {
        text_begin(&text);
        text_add(&text, "it is out of step for more than ");
        text_number(&text, allowed);
        text_add(&text, " rounds: the robot's frames collide, or it hears no other robot");
        board_event(EVENT_CLOCK_DOES_NOT_SETTLE, text.letters);
    }
}

void slot_clock_close_round(SlotClock *clock)
{
    int64_t sum_ns = 0, count = 0;
    for (uint32_t j = 0; j < MAX_ROBOTS; j++) {
        if (HAS(clock->heard, j)) {
            sum_ns += clock->error_ns[j];
            count++;
        }
    }
    const double error_ns = count > 0 ? (double)sum_ns / (double)count : 0.0;
    report(clock, error_ns);
    clock->heard = 0;
    if (count == 0) {
        return;
    }
    int64_t step_ns = rounded(-clock->gain * error_ns);
    if (clock->far_ns == 0 || size(error_ns) < (double)clock->far_ns) {
        step_ns = step_ns > clock->bound_ns ? clock->bound_ns : step_ns < -clock->bound_ns ? -clock->bound_ns : step_ns;
    }
    if (step_ns != 0) {
        board_adjust_clock(step_ns, 0.0);
    }
}
