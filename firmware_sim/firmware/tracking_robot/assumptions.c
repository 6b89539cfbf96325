/* assumptions.c: see assumptions.h. */
#include "assumptions.h"
#include "board_ids.h"
#include "marconet_board.h"
#include "marconet_functions.h"
#include "marconet_text.h"

#define BIT(assumption) (1u << (assumption))

static const char *const NAMES[ASSUMPTIONS] = {
    "age of information", "announcement of inputs", "gain of the inputs", "inputs of the reference",
    "small-gain product", "successive losses", "tracking error" };

void assumptions_init(Assumptions *watch, const Trigger *trigger, double radius, double noise)
{
    watch->trigger = trigger;
    watch->radius = radius + noise * square_root(3.0);
    watch->broken = 0;
}

/* Begin the text of a violation; return false if the assumption is broken already. */
static bool fails(Assumptions *watch, Assumption assumption, Text *text)
{
    if (watch->broken & BIT(assumption)) {
        return false;
    }
    watch->broken |= BIT(assumption);
    text_begin(text);
    text_add(text, NAMES[assumption]);
    text_add(text, ": ");
    return true;
}

static void violated(const Text *text)
{
    board_count(COUNTER_VIOLATED_ASSUMPTIONS, 1);
    board_event(EVENT_ASSUMPTION_VIOLATED, text->letters);
}

static void hold(Assumptions *watch, uint32_t assumptions)
{
    const uint32_t again = watch->broken & assumptions;
    Text text;
    if (again == 0) {
        return;
    }
    watch->broken &= ~again;
    text_begin(&text);
    for (uint32_t k = 0; k < ASSUMPTIONS; k++) {
        if (again & BIT(k)) {
            text_add(&text, text.length > 0 ? ", " : "");
            text_add(&text, NAMES[k]);
        }
    }
    board_event(EVENT_ASSUMPTIONS_HOLD_AGAIN, text.letters);
}

/* --- of the decision in force */

static void small_gain_text(Text *text, double product, double age_s)
{
    text_add(text, "gamma_n gamma_e = ");
    text_real(text, product, 6);
    text_add(text, " after ");
    text_real(text, age_s, 6);
    text_add(text, " s, expected below 1");
}

void assumptions_check(Assumptions *watch, const Decision *in_force, int64_t now_ns, int64_t failed)
{
    const double age_s = (double)(now_ns - in_force->measured_ns) * 1e-9;
    const double product = decision_gain_product(in_force, now_ns);
    const int64_t allowed = decision_losses_allowed(in_force);
    Text text;
    if (now_ns > in_force->measured_ns + in_force->valid_ns && fails(watch, FRESH, &text)) {
        text_add(&text, "the measurement in force is ");
        text_real(&text, age_s, 9);
        text_add(&text, " s old, certified for ");
        text_real(&text, (double)in_force->valid_ns * 1e-9, 9);
        text_add(&text, " s");
        violated(&text);
    }
    if (product >= 1.0 && fails(watch, SMALL_GAIN, &text)) {
        small_gain_text(&text, product, age_s);
        violated(&text);
        text_begin(&text);
        text_real(&text, product, 6);
        text_add(&text, ": ");
        small_gain_text(&text, product, age_s);
        board_event(EVENT_GAIN_PRODUCT, text.letters);
    }
    if (failed > allowed && fails(watch, LOSSES, &text)) {
        text_number(&text, failed);
        text_add(&text, " attempts in a row failed, ");
        text_number(&text, allowed);
        text_add(&text, " are allowed");
        violated(&text);
    }
}

void assumptions_in_time(Assumptions *watch) { hold(watch, BIT(FRESH) | BIT(SMALL_GAIN) | BIT(LOSSES)); }

/* --- of a measurement */

static void add_velocities(Text *text, Velocities velocities)
{
    text_add(text, "(");
    text_real(text, velocities.v, 9);
    text_add(text, ", ");
    text_real(text, velocities.omega, 9);
    text_add(text, ")");
}

static double norm3(TrackingError x) { return square_root(x.x1 * x.x1 + x.x2 * x.x2 + x.x3 * x.x3); }

void assumptions_judge(Assumptions *watch, TrackingError x, Velocities inputs, const Velocities *before)
{
    const Trigger *trigger = watch->trigger;
    const Velocities limits = trigger->limits;
    uint32_t found = 0, measurable = BIT(INPUTS) | BIT(ANNOUNCED);
    double gain = 0.0;
    Text text;
    if (trigger->policy == INDIVIDUAL_GAINS) {
        measurable |= BIT(GAIN);
    } else if (trigger->policy == PERIODIC) {
        measurable |= BIT(RADIUS);
    }
    if (!(magnitude(inputs.v) <= limits.v && magnitude(inputs.omega) <= limits.omega)) {
        found |= BIT(INPUTS);
    } else if (!trigger_gain(trigger, inputs, &gain)) {
        found |= BIT(GAIN);
    }
    if (before != NULL && (inputs.v != before->v || inputs.omega != before->omega)) {
        found |= BIT(ANNOUNCED);
    }
    if (!(norm3(x) <= watch->radius)) {
        found |= BIT(RADIUS);
    }
    found &= measurable;
    hold(watch, measurable & ~found);
    if (found & BIT(INPUTS) && fails(watch, INPUTS, &text)) {
        add_velocities(&text, inputs);
        text_add(&text, ", expected magnitudes of at most ");
        add_velocities(&text, limits);
        violated(&text);
    }
    if (found & BIT(GAIN) && fails(watch, GAIN, &text)) {
        text_add(&text, "none is known for ");
        add_velocities(&text, inputs);
        text_add(&text, "; the unified gain ");
        text_real(&text, trigger->unified_gain, 6);
        text_add(&text, " 1/s is used");
        violated(&text);
    }
    if (found & BIT(ANNOUNCED) && fails(watch, ANNOUNCED, &text)) {
        add_velocities(&text, *before);
        text_add(&text, " became ");
        add_velocities(&text, inputs);
        text_add(&text, " unannounced, since the measurement before");
        violated(&text);
    }
    if (found & BIT(RADIUS) && fails(watch, RADIUS, &text)) {
        text_add(&text, "|x| = ");
        text_real(&text, norm3(x), 6);
        text_add(&text, ", certified up to ");
        text_real(&text, watch->radius, 6);
        violated(&text);
    }
}
