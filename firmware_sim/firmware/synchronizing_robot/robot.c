/* robot.c: one robot of a team that synchronizes its outputs by slotted broadcasts (Chapter 6), as
 * agents/synchronization/robot.py.
 *
 *     its slot:        measure y_i, broadcast it, hold it                                        (6.11), Protocol 1
 *     a sync frame:    hold the sender's output, compute u_i anew
 *     a round's end:   adopt a new topology, if there is one: new parts, new slot length, new neighbours
 *
 * All times are local. The robot holds its own new value only from the instant at which the others can have received
 * it, with own_value = "late" in the team's table only after the added delays of its links as well. The disturbance omega_i of (6.6) adds to u_i. */
#include <string.h>
#include "age_watch.h"
#include "agreement.h"
#include "board_ids.h"
#include "discovery.h"
#include "marconet_board.h"
#include "marconet_numbers.h"
#include "slot_clock.h"
#include "slots.h"
#include "sync_frame.h"
#include "team.h"
#include "text.h"
#include "topology.h"

/* With late own values, or a clock that is set forward, several own values wait at a time until they are held.
 * The disturbance has a timer for each piece, all armed at the start, so that no later change of the clock moves them. */
enum { HOLDS = 8, PIECES = 20, TIMER_WAKE = 0, TIMER_HOLD_OWN = 1, TIMER_DISTURB = TIMER_HOLD_OWN + HOLDS };
typedef enum { BEGIN, SPEAK, DISCOVER, ADOPT } Act;

static Team team;
static Agreement law;
static SlotClock slot_clock;
static AgeWatch watch;
static Slots slots;
static uint8_t part_of[MAX_ROBOTS];
static int64_t part;                    /* of this robot */
static int64_t slot;                    /* number of its next slot */
static int64_t last_control;            /* number of the slot of its last control sub-slot */
static int64_t since_ns;                /* local time from which the schedule is in force */
static int64_t certified_ns;
static int64_t judged_ns;               /* age up to which a value is proved to be harmless, 0: a slot's length */
static Robots heard;                    /* robots whose sync frames arrived since the last own slot */
static double spoken[HOLDS][MAX_VALUES];    /* own outputs broadcast last */
static uint32_t holds;                  /* number of own values sent */
static double omega;
static Act act;
static int64_t adoption_ns, control_slot;

/* --- plant and control */

static void measure(double *outputs)
{
    for (uint32_t k = 0; k < team.outputs; k++) {
        board_sense(SENSOR_Y + k, outputs + k);
    }
}

static void apply(void)
{
    double control[MAX_VALUES];
    agreement_control(&law, control);
    for (uint32_t k = 0; k < team.inputs; k++) {
        board_actuate(ACTUATOR_U + k, omega != 0.0 ? control[k] + omega : control[k]);
    }
}

static void hold_own(uint32_t hold)
{
    agreement_hold(&law, team.number, spoken[hold]);
    apply();
}

static void disturb(uint32_t piece)
{
    omega = team_value(PARAMETER_DISTURBANCE, 2 * piece + 1);
    apply();
}

/* --- schedules */

static int64_t control_offset_ns(int64_t slot_ns)
{
    const int64_t free_ns = slot_ns - team.data_airtime_ns - team.control_airtime_ns;
    return team.data_airtime_ns + floor_div(2 * free_ns, 3);
}

static Slots slots_of(const Design *design, int64_t start_ns)
{
    const Slots made = { design->parts, design->slot_ns, start_ns, team.guard_ns, team.discovered ? team.robots : 0,
                         team.discovered ? control_offset_ns(design->slot_ns) : 0 };
    return made;
}

static void follow(const Design *design, Slots schedule)
{
    agreement_listen_to(&law, design->heard[team.number], heard);
    heard = 0;
    memcpy(part_of, design->part, sizeof part_of);
    part = part_of[team.number];
    certified_ns = design->certified_ns;
    judged_ns = design->assumed_ns > 0 ? design->assumed_ns + team.guard_ns : 0;
    slots = schedule;
    slot = part;                        /* in the first round slot k belongs to part k */
    last_control = -1;
}

/* Report a slot length chosen by the scenario's author that is longer than the certified one. */
static void report_own_slots(void)
{
    if (0 < certified_ns && certified_ns < slots.slot_ns) {
        Text text;
        text_begin(&text);
        text_add(&text, "slots of ");
        text_number(&text, slots.slot_ns);
        text_add(&text, " ns, as team.slot_us says: expected at most ");
        text_number(&text, certified_ns);
        text_add(&text, " ns, which (6.20) certifies");
        board_event(EVENT_ASSUMPTION_VIOLATED, text.letters);
    }
}

/* Return to the slots of the start, since the robots may use different ones. These lie on a grid from local time 0, the
 * same for all. Neighbours and their values stay. */
static void fall_back(const char *why)
{
    Design design;
    Text text;
    team_boot_design(&team, &design);
    age_watch_forget(&watch);
    since_ns = board_now();
    slots = slots_of(&design, 0);
    memcpy(part_of, design.part, sizeof part_of);
    part = team.number;
    slot = slots_next_of(&slots, part, since_ns - 1, -1);
    last_control = -1;
    heard = 0;
    topology_fell_back();
    board_count(COUNTER_FALLBACKS, 1);
    text_begin(&text);
    text_add(&text, "to the slots of the start: ");
    text_add(&text, why);
    board_event(EVENT_FELL_BACK, text.letters);
}

static void keep_topology(const char *why, const Robots *links)
{
    Text text;
    text_begin(&text);
    text_add(&text, why);
    text_links(&text, &team, links);
    board_event(EVENT_KEPT_TOPOLOGY, text.letters);
}

/* --- the program */

/* Arm the timer for the next own slot, control sub-slot or adoption, whichever is first. */
static void plan(void)
{
    const int64_t now_ns = board_now();
    int64_t first_ns = slots_data_ns(&slots, slot);
    if (first_ns < now_ns) {            /* the clock was set forward: this slot is over */
        slot = slots_next_of(&slots, part, now_ns - 1, slot - 1);
        first_ns = slots_data_ns(&slots, slot);
    }
    act = SPEAK;
    if (topology_wants_control(&team, &slots)) {
        const int64_t control = slots_next_control_of(&slots, team.number, now_ns - 1, last_control);
        if (slots_control_ns(&slots, control) < first_ns) {
            first_ns = slots_control_ns(&slots, control);
            control_slot = control;
            act = DISCOVER;
        }
    }
    if (topology_adoption_ns(&team, &slots, now_ns, &adoption_ns) && adoption_ns <= first_ns) {
        first_ns = adoption_ns;
        act = ADOPT;
    }
    board_set_timer(TIMER_WAKE, first_ns, 0);
}

static void speak(void)
{
    uint8_t bytes[SYNC_FRAME_BYTES];
    const int64_t spoken_slot = slot;
    const uint32_t hold = holds++ % HOLDS;
    slot += slots.parts;
    topology_before_own_slot(&team, &slots, spoken_slot, heard);
    heard = 0;
    measure(spoken[hold]);
    board_send(PORT_RADIO, bytes, sync_frame_pack(&team, spoken_slot, spoken[hold], bytes));
    if (team.own_delay_ns > 0) {
        board_set_delay(TIMER_HOLD_OWN + hold, team.own_delay_ns, BOARD_SILENT);
    } else {
        hold_own(hold);
    }
    if (topology_out_of_step()) {
        fall_back("somebody's control frame came in a slot that is not its own");
    }
    if (team.resynchronize) {
        slot_clock_close_round(&slot_clock);
    }
}

static void discover(void)
{
    uint8_t bytes[DISCOVERY_BYTES];
    last_control = control_slot;
    const uint32_t length = topology_control_frame(&team, &slots, board_now(), bytes);
    if (length > 0) {
        board_send(PORT_RADIO, bytes, length);
    }
}

/* Adopt the topology at `adoption_ns`, the exact end of the round, on which all robots agree. */
static void adopt(void)
{
    Robots links[MAX_ROBOTS];
    Design design;
    Text text;
    if (!topology_adopt(&team, adoption_ns, links)) {
        fall_back("its discovery was incomplete");
        return;
    }
    if (!team_find_design(&team, links, &design)) {
        keep_topology("its robots have no design for ", links);
        return;
    }
    if (design.slot_ns < team.slot_needs_ns) {
        keep_topology("its slots do not hold their frames for ", links);
        return;
    }
    age_watch_retire(&watch, &slots, part_of, since_ns, adoption_ns);
    since_ns = adoption_ns;
    follow(&design, slots_of(&design, adoption_ns));
    board_count(COUNTER_ADOPTIONS, 1);
    text_begin(&text);
    text_links(&text, &team, links);
    board_event(EVENT_ADOPTED_TOPOLOGY, text.letters);
    report_own_slots();
    apply();
}

static void wake(void)
{
    switch (act) {
    case BEGIN:
        apply();
        report_own_slots();
        break;
    case SPEAK:
        speak();
        break;
    case DISCOVER:
        discover();
        break;
    case ADOPT:
        adopt();
        break;
    }
    plan();
}

/* --- receive */

/* Report a value older than a slot and than the delay with which the exact loop is stable; with discovered topologies every robot that is heard is a neighbour. */
static void check_age(const SyncFrame *frame)
{
    int64_t age_ns;
    Text text;
    if (!team.discovered && !HAS(law.neighbours, frame->sender)) {
        return;
    }
    if (!age_watch_age(&watch, frame->sender, frame->slot, board_now(), &slots, part_of, since_ns, &age_ns)
        || age_ns < slots.slot_ns || age_ns <= judged_ns) {
        return;
    }
    board_count(COUNTER_VALUES_TOO_OLD, 1);
    if (age_watch_is_news(&watch, frame->sender, age_ns)) {
        text_begin(&text);
        text_add(&text, "age of information: ");
        text_robot(&text, frame->sender);
        text_add(&text, "'s value is ");
        text_number(&text, age_ns);
        text_add(&text, " ns old when it comes: expected ");
        if (judged_ns < slots.slot_ns) {
            text_add(&text, "less than ");
            text_number(&text, slots.slot_ns);
            text_add(&text, " ns, the slot length");
        } else {
            text_add(&text, "at most ");
            text_number(&text, judged_ns);
            text_add(&text, " ns, the delay with which its slots are stable");
        }
        board_event(EVENT_ASSUMPTION_VIOLATED, text.letters);
    }
}

static void synchronize(const SyncFrame *frame)
{
    const int64_t arrived_ns = board_now();
    const int64_t its_part = part_of[frame->sender];
    int64_t number = slots_nearest_of(&slots, its_part, arrived_ns - team.data_airtime_ns - team.latency_ns);
    if (!team.discovered && frame->slot % slots.parts == its_part) {
        number = frame->slot;           /* a clock that was stepped may be off by rounds */
    }
    slot_clock_heard(&slot_clock, &team, frame->sender, slots_data_ns(&slots, number), arrived_ns);
}

/* --- what the board calls */

int32_t board_start(void)
{
    Design design;
    const uint32_t pieces = (uint32_t)board_parameter_length(PARAMETER_DISTURBANCE_FROM_NS);
    if (!team_read(&team) || pieces > PIECES) {
        return 1;
    }
    agreement_init(&law, &team);
    slot_clock_init(&slot_clock, &team);
    age_watch_init(&watch, &team);
    topology_init(&team);
    if (team.discovered) {
        team_boot_design(&team, &design);
    } else {
        team_design(&team, (uint32_t)team_value(PARAMETER_REQUEST_DESIGN, 0), &design);
    }
    follow(&design, slots_of(&design, 0));
    for (uint32_t j = 0; j < team.robots && board_parameter_length(PARAMETER_START_OUTPUTS) > 0; j++) {
        double outputs[MAX_VALUES];
        for (uint32_t k = 0; k < team.outputs; k++) {
            outputs[k] = team_value(PARAMETER_START_OUTPUTS, j * team.outputs + k);
        }
        agreement_hold(&law, j, outputs);
    }
    act = BEGIN;
    board_set_timer(TIMER_WAKE, board_now(), 0);
    for (uint32_t piece = 0; piece < pieces; piece++) {
        board_set_timer(TIMER_DISTURB + piece, team_whole(PARAMETER_DISTURBANCE_FROM_NS, piece), BOARD_SILENT);
    }
    return 0;
}

void board_timer(uint32_t timer)
{
    if (timer == TIMER_WAKE) {
        wake();
    } else if (timer < TIMER_DISTURB) {
        hold_own(timer - TIMER_HOLD_OWN);
    } else {
        disturb(timer - TIMER_DISTURB);
    }
}

void board_receive(uint32_t port, const uint8_t *data, uint32_t length)
{
    SyncFrame frame;
    (void)port;
    if (!sync_frame_unpack(&team, data, length, &frame)) {
        const int64_t sent_ns = board_now() - team.control_airtime_ns - team.latency_ns;
        if (!topology_heard_control(&team, &slots, data, length, sent_ns)) {
            board_count(COUNTER_UNREADABLE_FRAMES, 1);
        }
        return;
    }
    if (frame.sender == team.number) {
        board_count(COUNTER_UNREADABLE_FRAMES, 1);
        return;
    }
    if (team.watches_age) {
        check_age(&frame);
    }
    heard = (Robots)(heard | ONLY(frame.sender));
    agreement_hold(&law, frame.sender, frame.outputs);
    if (team.resynchronize) {
        synchronize(&frame);
    }
    if (HAS(law.neighbours, frame.sender)) {
        apply();
    }
}
