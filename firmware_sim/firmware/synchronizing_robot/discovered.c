/* discovered.c: see discovered.h. */
#include "discovered.h"
#include <string.h>
#include "board_ids.h"
#include "discovery.h"
#include "marconet_board.h"
#include "marconet_numbers.h"
#include "text.h"

enum { INBOX = 32, JOIN_DELAY_CYCLES = 1 };     /* frames received between two slots of its own: at most one a slot */

typedef struct {
    uint32_t owner;             /* of the control slot */
    uint32_t length;
    int64_t cycle;
    uint8_t bytes[DISCOVERY_BYTES];
} Received;

static Discovery discovery;
static Received inbox[INBOX];
static uint32_t received;
static Robots neighbours;
static uint32_t missed[MAX_ROBOTS];     /* slots in a row without this neighbour's frame */
static int64_t own_slots;               /* since the schedule is in force */
static bool adopts;
static bool out_of_step;                /* a control frame arrived in a slot not its sender's */

void discovered_init(const Team *team)
{
    discovery_init(&discovery, team, JOIN_DELAY_CYCLES);
    discovery_trigger(&discovery, 0);
}

static void forget_missed(void) { memset(missed, 0, sizeof missed); }

static void read_inbox(void)
{
    for (uint32_t k = 0; k < received; k++) {
        if (!discovery_hear(&discovery, inbox[k].owner, inbox[k].bytes, inbox[k].length, inbox[k].cycle)) {
            board_count(COUNTER_REFUSED_CONTROL_FRAMES, 1);
        }
    }
    received = 0;
    adopts = adopts || discovery.phase == RUNNING;
}

bool discovered_heard(const Team *team, const Slots *slots, const uint8_t *bytes, uint32_t length, int64_t sent_ns)
{
    DiscoveryFrame frame;
    const int64_t slot = slots_at(slots, sent_ns);
    if (slot < 0) {
        return false;
    }
    const uint32_t owner = (uint32_t)(slot % team->robots);
    const int64_t cycle = slot / team->robots;
    if (discovery_decode(&discovery, bytes, length, &frame) && !discovery_fits(&discovery, &frame, owner, cycle)) {
        out_of_step = true;
    }
    if (received == INBOX) {
        board_count(COUNTER_REFUSED_CONTROL_FRAMES, 1);
        return true;
    }
    Received *kept = inbox + received++;
    kept->owner = owner;
    kept->cycle = cycle;
    kept->length = length <= DISCOVERY_BYTES ? length : 0;      /* 0: no discovery frame, refused when it is read */
    memcpy(kept->bytes, bytes, kept->length);
    return true;
}

/* Whether a frame of each neighbour has come since the last own slot unless it is lost: in the own slot after the k-th of
 * a schedule if every value arrives in less than k - 1 rounds and a slot. */
static bool all_due(const Team *team, const Slots *slots)
{
    return own_slots > 0 && team->oldest_value_ns < ((own_slots - 1) * slots->parts + 1) * slots->slot_ns;
}

/* Write to `text` why the topology must have changed; false if no received frame contradicts it. */
static bool contradicted(const Team *team, const Slots *slots, Robots heard, Text *text)
{
    text_begin(text);
    text_add(text, "robot ");
    text_number(text, team->number + 1);
    for (uint32_t j = 0; j < team->robots; j++) {
        if (HAS(heard & ~neighbours, j)) {
            text_add(text, " hears robot ");
            text_number(text, j + 1);
            text_add(text, ", which is no neighbour");
            return true;
        }
    }
    for (uint32_t j = 0; all_due(team, slots) && j < team->robots; j++) {
        if (!HAS(neighbours, j)) {
            continue;
        }
        missed[j] = HAS(heard, j) ? 0 : missed[j] + 1;
        if (missed[j] > team->max_successive_losses) {
            text_add(text, " missed the frame of robot ");
            text_number(text, j + 1);
            text_add(text, " in its slot");
            if (missed[j] > 1) {
                text_add(text, " ");
                text_number(text, missed[j]);
                text_add(text, " times in a row");
            }
            return true;
        }
    }
    return false;
}

void discovered_before_own_slot(const Team *team, const Slots *slots, int64_t slot, Robots heard)
{
    Text text;
    if (received > 0) {
        read_inbox();
    }
    if (heard == neighbours) {
        forget_missed();
    } else if (discovery.phase == SILENT && !adopts && neighbours != 0 && contradicted(team, slots, heard, &text)) {
        board_event(EVENT_TOPOLOGY_CHANGED, text.letters);
        discovery_trigger(&discovery, floor_div(slot, slots->robots));
    }
    own_slots++;
}

bool discovered_out_of_step(void) { return out_of_step; }

void discovered_fell_back(void)
{
    received = 0;
    forget_missed();
    out_of_step = adopts = false;
    own_slots = 0;
    discovery_abandon(&discovery);
}

bool discovered_wants_control(void) { return discovery.phase != SILENT; }

uint32_t discovered_control_frame(const Team *team, const Slots *slots, int64_t local_ns, uint8_t *bytes)
{
    read_inbox();
    const bool started = discovery.phase == ARMED;
    const uint32_t length = discovery_frame_to_send(
        &discovery, floor_div(slots_at(slots, local_ns), team->robots), bytes);
    if (length > 0 && started) {
        board_count(COUNTER_DISCOVERIES_STARTED, 1);
    }
    adopts = adopts || discovery.phase == RUNNING;
    return length;
}

bool discovered_adoption_ns(const Team *team, const Slots *slots, int64_t *at_ns)
{
    const int64_t first_slot = discovery_end_cycle(&discovery) * team->robots;
    *at_ns = slots_round_end_after(slots, slots->start_ns + first_slot * slots->slot_ns - 1);
    return adopts;
}

static void explain(const Team *team)
{
    Text text;
    const char *between = "no record of node ";
    text_begin(&text);
    for (uint32_t i = 0; i < team->robots; i++) {
        if (discovery.records[i] == 0) {
            text_add(&text, between);
            text_number(&text, i + 1);
            between = ", ";
        }
    }
    if (text.length > 0) {
        text_add(&text, ": it hears nobody, or nothing of it comes through (Assumption 7)");
    }
    for (uint32_t i = 0; i < team->robots && text.length == 0; i++) {
        const Robots reached = discovery_reached_from(&discovery, i);
        for (uint32_t j = 0; j < team->robots && text.length == 0; j++) {
            if (!HAS(reached, j)) {
                text_add(&text, "no path from node ");
                text_number(&text, i + 1);
                text_add(&text, " to node ");
                text_number(&text, j + 1);
                text_add(&text, ": the graph is not strongly connected (Assumption 7)");
            }
        }
    }
    board_event(EVENT_INCOMPLETE_DISCOVERY, text.letters);
}

bool discovered_adopt(const Team *team, Robots *heard)
{
    read_inbox();
    adopts = false;
    own_slots = 0;
    forget_missed();
    if (discovery_finish(&discovery) != COMPLETE) {
        board_count(COUNTER_INCOMPLETE_DISCOVERIES, 1);
        explain(team);
        return false;
    }
    neighbours = discovery.records[team->number];
    memcpy(heard, discovery.records, sizeof discovery.records);
    return true;
}
