/* robot.c: the companion computer of the robot R1 of Chapter 4, as agents/tracking/tracking_robot.py.
 *
 *     look due:    send a request to the reference R2 over the radio
 *     answer:      x^ from own pose and R2's; u by (4.4); send a setpoint over CAN
 *                  tau_i by the policy (4.37): when the next look is due
 *
 * A measurement's age counts from its request. The next request is sent early by the time that the last exchange took, so
 * that the command computed from its answer is in force within tau_i. A request without an answer is repeated. An
 * announcement of new inputs by R2 is a measurement too (section 4.6).
 *
 * A measurement is in force when the drive has confirmed the setpoint computed from it. The robot checks the assumptions
 * of its trigger with the information that it has (assumptions.h). The uniform nu in [-a, a]^3 that section 4.6 adds to a
 * measurement is drawn here; a = 0 where real sensors bring their own.
 *
 * Not modelled: computing time between an answer and the setpoint, unless the board's processor needs some. */
#include <string.h>
#include "assumptions.h"
#include "board_ids.h"
#include "controller.h"
#include "dead_reckoning.h"
#include "drive_link.h"
#include "look_frames.h"
#include "marconet_board.h"
#include "marconet_numbers.h"
#include "marconet_text.h"
#include "trigger.h"

enum { TIMER_LOOK, TIMER_REPEAT, TIMER_FRESH, TIMER_UNSTABLE };
enum { UNDERWAY = 256 };                /* numbers of setpoints */
static const int64_t RETRY_NS = 20000000;       /* between requests before the first measurement */

typedef struct {
    Decision decision;
    uint32_t measurement;               /* number of the measurement that it was made from */
} Numbered;

static Trigger trigger;
static Assumptions assumptions;
static DriveLink drive;
static DeadReckoning place;
static double noise;
static int64_t refresh_ns, odometry_age_ns, actuation_ns;

static Velocities inputs, command;      /* of R2 as received last; to the drive */
static bool has_inputs;
static Numbered latest, in_force;       /* decisions of the newest measurement and of that in force */
static bool has_latest, is_in_force;
static Numbered underway[UNDERWAY];     /* decision of each unconfirmed setpoint, by the setpoint's number */
static uint32_t unconfirmed;            /* setpoints, the last of which has `drive.number` */
static uint32_t measurements;
static int64_t look = -1;               /* number of the last request */
static int64_t asked_ns;
static bool waiting;                    /* for the answer to it */
static int64_t failed;                  /* requests in a row without an answer */
static int64_t exchange_ns;             /* duration of the last exchange */

static double number(uint32_t parameter, uint32_t index)
{
    double value = 0.0;
    board_parameter(parameter, index, &value);
    return value;
}

/* Return a number of [0, 1) with 53 random bits. */
static double uniform(void)
{
    const uint32_t high = board_random() >> 5, low = board_random() >> 6;
    return ((double)high * 67108864.0 + (double)low) * (1.0 / 9007199254740992.0);
}

static double noisy(double value) { return value + noise * (2.0 * uniform() - 1.0); }

static void check(void)
{
    if (is_in_force) {
        assumptions_check(&assumptions, &in_force.decision, board_now() - actuation_ns, failed);
    }
}

/* --- the drive */

static void tell_drive(void)
{
    uint8_t bytes[CAN_BYTES];
    drive_link_setpoint(&drive, command, bytes);
    board_send(PORT_CAN, bytes, sizeof bytes);
    underway[drive.number] = latest;
    if (unconfirmed < UNDERWAY) {
        unconfirmed++;
    }
    board_set_timer(TIMER_REPEAT, board_now() + refresh_ns, 0);
}

static void leave(const Decision *before, int64_t now_ns)
{
    const int64_t until_ns = now_ns - actuation_ns;
    Text text;
    check();
    text_begin(&text);
    text_real(&text, decision_gain_product(before, until_ns), 6);
    text_add(&text, " after ");
    text_real(&text, (double)larger(until_ns - before->measured_ns, 0) * 1e-9, 6);
    text_add(&text, " s");
    board_event(EVENT_GAIN_PRODUCT, text.letters);
}

/* Put the decision of setpoint `confirmed` in force; drop it and those sent before it from the unconfirmed ones. */
static void come_into_force(uint8_t confirmed)
{
    const uint32_t later = (uint8_t)(drive.number - confirmed);         /* setpoints sent since */
    const int64_t now_ns = board_now();
    if (later >= unconfirmed) {
        return;
    }
    unconfirmed = later;
    const Numbered *numbered = &underway[confirmed];
    if (is_in_force && numbered->measurement == in_force.measurement) {
        return;
    }
    if (is_in_force) {
        leave(&in_force.decision, now_ns);
    }
    in_force = *numbered;
    is_in_force = true;
    const Decision *decision = &in_force.decision;
    const int64_t holds_until_ns = decision->measured_ns + decision->valid_ns;
    board_record(SIGNAL_TAU, (double)decision->valid_ns * 1e-9);
    if (now_ns <= holds_until_ns + actuation_ns) {
        assumptions_in_time(&assumptions);
    }
    const double unstable_s = horizon_s(decision->growth_per_s, decision->gain_per_s, 1.0);
    const int64_t unstable_ns = decision->measured_ns + (int64_t)(unstable_s * 1e9);
    board_set_timer(TIMER_FRESH, holds_until_ns + 1 + actuation_ns, BOARD_SILENT);
    board_set_timer(TIMER_UNSTABLE, unstable_ns + 1 + actuation_ns, BOARD_SILENT);
}

static void hear_drive(const uint8_t *data, uint32_t length)
{
    switch (drive_link_read(&drive, data, length)) {
    case UNREADABLE:
        board_count(COUNTER_UNREADABLE_CAN_FRAMES, 1);
        break;
    case ANGLES:
        dead_reckoning_read(&place, board_now() - odometry_age_ns, drive.left, drive.right);
        break;
    case CONFIRMED:
        come_into_force(drive.confirmed);
        break;
    case OTHER:
        break;
    }
}

/* --- looks */

static void ask(void)
{
    uint8_t bytes[REQUEST_BYTES];
    const int64_t now_ns = board_now();
    if (waiting) {
        failed++;
        board_count(COUNTER_LOOKS_WITHOUT_AN_ANSWER, 1);
    }
    look++;
    asked_ns = now_ns;
    waiting = true;
    request_pack(look, bytes);
    board_send(PORT_RADIO, bytes, sizeof bytes);
    board_count(COUNTER_LOOKS, 1);
    check();
    const int64_t retry_ns = has_latest ? decision_attempt_ns(&latest.decision, failed + 1) - exchange_ns
                                        : now_ns + RETRY_NS;
    board_set_timer(TIMER_LOOK, larger(retry_ns, now_ns + 1), 0);
}

static void refuse(TrackingError x)
{
    Text text;
    text_begin(&text);
    text_add(&text, "x=(");
    text_real(&text, x.x1, 9);
    text_add(&text, ", ");
    text_real(&text, x.x2, 9);
    text_add(&text, ", ");
    text_real(&text, x.x3, 9);
    text_add(&text, "): no tracking error [m, m, rad]; leave such a measurement out");
    board_count(COUNTER_REFUSED_MEASUREMENTS, 1);
    board_event(EVENT_REFUSED_MEASUREMENT, text.letters);
}

/* Apply a measurement. `measured_ns`: start of its age; `seen_ns`: best estimate of when `answer` was true. */
static void measure(const Answer *answer, int64_t measured_ns, int64_t seen_ns)
{
    TrackingError x = tracking_error(dead_reckoning_at(&place, seen_ns), answer->pose);
    Numbered made;
    x.x1 = noisy(x.x1);
    x.x2 = noisy(x.x2);
    x.x3 = noisy(x.x3);
    board_record(SIGNAL_HELD1, x.x1);
    board_record(SIGNAL_HELD2, x.x2);
    board_record(SIGNAL_HELD3, x.x3);
    failed = 0;
    if (!trigger_decide(&trigger, measured_ns, x, answer->inputs, &made.decision)) {
        refuse(x);
        return;
    }
    made.measurement = ++measurements;
    latest = made;
    has_latest = true;
    assumptions_judge(&assumptions, x, answer->inputs, has_inputs ? &inputs : NULL);
    inputs = answer->inputs;
    has_inputs = true;
    command = control(&trigger.gains, x, inputs);
    tell_drive();
    board_count(COUNTER_MEASUREMENTS, 1);
    const int64_t next_ns = measured_ns + made.decision.interval_ns - exchange_ns;
    board_set_timer(TIMER_LOOK, larger(next_ns, board_now() + 1), 0);
}

static void hear(const uint8_t *data, uint32_t length)
{
    const int64_t now_ns = board_now();
    Answer answer;
    if (!answer_unpack(data, length, &answer)) {
        board_count(COUNTER_UNREADABLE_FRAMES, 1);
    } else if (answer.look == UNASKED) {
        waiting = false;                /* an answer still to come would be older */
        inputs = answer.inputs;
        has_inputs = true;
        measure(&answer, now_ns, now_ns);
    } else if (!waiting || answer.look != look_number(look)) {
        board_count(COUNTER_LATE_ANSWERS, 1);
    } else {
        waiting = false;
        exchange_ns = now_ns - asked_ns;
        measure(&answer, asked_ns, floor_div(asked_ns + now_ns, 2));
    }
}

/* --- what the board calls */

int32_t board_start(void)
{
    const double radius = number(PARAMETER_WHEEL_RADIUS_M, 0), track = number(PARAMETER_TRACK_M, 0);
    const Pose start = { number(PARAMETER_START, 0), number(PARAMETER_START, 1), number(PARAMETER_START, 2) };
    refresh_ns = (int64_t)number(PARAMETER_REFRESH_NS, 0);
    odometry_age_ns = (int64_t)number(PARAMETER_ODOMETRY_AGE_NS, 0);
    actuation_ns = (int64_t)number(PARAMETER_ACTUATION_NS, 0);
    noise = number(PARAMETER_MEASUREMENT_NOISE, 0);
    trigger_init(&trigger);
    assumptions_init(&assumptions, &trigger, number(PARAMETER_CERTIFIED_RADIUS, 0), noise);
    drive_link_init(&drive, radius, track, number(PARAMETER_COUNTS_PER_TURN, 0));
    dead_reckoning_init(&place, radius, track, start);
    if (!(radius > 0.0 && track > 0.0)) {
        return 1;
    }
    board_set_timer(TIMER_LOOK, board_now(), 0);
    return 0;
}

void board_timer(uint32_t timer)
{
    if (timer == TIMER_LOOK) {
        ask();
    } else if (timer == TIMER_REPEAT) {
        tell_drive();
    } else {
        check();
    }
}

void board_receive(uint32_t port, const uint8_t *data, uint32_t length)
{
    if (port == PORT_RADIO) {
        hear(data, length);
    } else {
        hear_drive(data, length);
    }
}
