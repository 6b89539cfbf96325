/* discovery.c: the state machine of one node, see discovery.h. */
#include "discovery.h"
#include <string.h>

enum { MAGIC = 0xD7, VERSION = 1, HEADER_BYTES = 10 };

static uint32_t width(const Discovery *discovery) { return (discovery->size + 7) / 8; }

static uint32_t frame_bytes(const Discovery *discovery) { return HEADER_BYTES + discovery->size * width(discovery); }

void discovery_init(Discovery *discovery, const Team *team, int64_t join_delay_cycles)
{
    const int64_t N = team->robots, R = team->max_successive_losses + 1;
    memset(discovery, 0, sizeof *discovery);
    discovery->node = team->number;
    discovery->size = team->robots;
    discovery->cycles = R * (2 * N - 1) + join_delay_cycles * (N - 1);
    discovery->flood_cycles = (N - 1) * R;
    discovery->phase = SILENT;
    discovery->outcome = NONE;
    discovery->start_cycle = -discovery->cycles;
}

int64_t discovery_end_cycle(const Discovery *discovery) { return discovery->start_cycle + discovery->cycles; }

Robots discovery_reached_from(const Discovery *discovery, uint32_t node)
{
    Robots reached = ONLY(node), before = 0;
    while (reached != before) {
        before = reached;
        for (uint32_t i = 0; i < discovery->size; i++) {
            if ((discovery->records[i] & reached) != 0) {
                reached = (Robots)(reached | ONLY(i));
            }
        }
    }
    return reached;
}

static void end_if_due(Discovery *discovery, int64_t cycle)
{
    if (discovery->phase != RUNNING || cycle < discovery_end_cycle(discovery)) {
        return;
    }
    discovery->phase = SILENT;
    discovery->outcome = COMPLETE;
    for (uint32_t i = 0; i < discovery->size; i++) {
        if (discovery_reached_from(discovery, i) != (Robots)((1u << discovery->size) - 1u)) {
            discovery->outcome = INCOMPLETE;
        }
    }
}

static void join(Discovery *discovery, uint16_t epoch, int64_t start_cycle)
{
    discovery->phase = RUNNING;
    discovery->epoch = epoch;
    discovery->start_cycle = start_cycle;
    memset(discovery->records, 0, sizeof discovery->records);
    discovery->outcome = NONE;
}

void discovery_trigger(Discovery *discovery, int64_t cycle)
{
    end_if_due(discovery, cycle);
    if (discovery->phase == SILENT) {
        discovery->phase = ARMED;
    }
}

void discovery_abandon(Discovery *discovery)
{
    discovery->phase = ARMED;
    discovery->outcome = NONE;
}

bool discovery_decode(const Discovery *discovery, const uint8_t *bytes, uint32_t length, DiscoveryFrame *frame)
{
    if (length != frame_bytes(discovery) || bytes[0] != MAGIC || bytes[1] != VERSION || bytes[2] >= discovery->size
        || bytes[3] != discovery->size) {
        return false;
    }
    frame->sender = bytes[2];
    frame->epoch = (uint16_t)(bytes[4] | bytes[5] << 8);
    frame->start_cycle = (int64_t)bytes[6] | (int64_t)bytes[7] << 8 | (int64_t)bytes[8] << 16 | (int64_t)bytes[9] << 24;
    for (uint32_t i = 0; i < discovery->size; i++) {
        const uint8_t *at = bytes + HEADER_BYTES + i * width(discovery);
        const uint32_t record = width(discovery) == 1 ? at[0] : (uint32_t)(at[0] | at[1] << 8);
        if (record >> discovery->size != 0 || HAS(record, i)) {
            return false;       /* a node that does not exist, or one that hears itself */
        }
        frame->records[i] = (Robots)record;
    }
    return true;
}

bool discovery_fits(const Discovery *discovery, const DiscoveryFrame *frame, uint32_t owner, int64_t cycle)
{
    return frame->sender == owner && frame->start_cycle <= cycle && cycle < frame->start_cycle + discovery->cycles;
}

uint32_t discovery_frame_to_send(Discovery *discovery, int64_t cycle, uint8_t *bytes)
{
    end_if_due(discovery, cycle);
    if (discovery->phase == ARMED) {
        join(discovery, (uint16_t)(discovery->epoch + 1), cycle);
    }
    if (discovery->phase == SILENT) {
        return 0;
    }
    const uint8_t header[HEADER_BYTES] = {
        MAGIC, VERSION, (uint8_t)discovery->node, (uint8_t)discovery->size, (uint8_t)discovery->epoch,
        (uint8_t)(discovery->epoch >> 8), (uint8_t)discovery->start_cycle, (uint8_t)(discovery->start_cycle >> 8),
        (uint8_t)(discovery->start_cycle >> 16), (uint8_t)(discovery->start_cycle >> 24) };
    memcpy(bytes, header, sizeof header);
    for (uint32_t i = 0; i < discovery->size; i++) {
        uint8_t *at = bytes + HEADER_BYTES + i * width(discovery);
        at[0] = (uint8_t)discovery->records[i];
        if (width(discovery) > 1) {
            at[1] = (uint8_t)(discovery->records[i] >> 8);
        }
    }
    return frame_bytes(discovery);
}

bool discovery_hear(Discovery *discovery, uint32_t owner, const uint8_t *bytes, uint32_t length, int64_t cycle)
{
    DiscoveryFrame frame;
    end_if_due(discovery, cycle);
    if (!discovery_decode(discovery, bytes, length, &frame) || owner == discovery->node
        || !discovery_fits(discovery, &frame, owner, cycle)) {
        return false;
    }
    const uint16_t ahead = (uint16_t)(frame.epoch - discovery->epoch);
    if (ahead > 0 && ahead < 0x8000) {
        join(discovery, frame.epoch, frame.start_cycle);
    } else if (ahead != 0 || discovery->phase != RUNNING) {
        if (ahead != 0 || frame.start_cycle > discovery->start_cycle) {
            discovery_trigger(discovery, cycle);    /* the sender restarted or was out of reach */
        }
        return false;
    }
    if (frame.start_cycle < discovery->start_cycle) {
        discovery->start_cycle = frame.start_cycle;
    }
    for (uint32_t i = 0; i < discovery->size; i++) {
        if (i != discovery->node) {
            discovery->records[i] = (Robots)(discovery->records[i] | frame.records[i]);
        }
    }
    if (cycle < discovery_end_cycle(discovery) - discovery->flood_cycles) {     /* a later one would not reach all */
        Robots *own = discovery->records + discovery->node;
        *own = (Robots)(*own | ONLY(owner));
    }
    return true;
}

Outcome discovery_finish(Discovery *discovery)
{
    end_if_due(discovery, discovery_end_cycle(discovery));
    return discovery->outcome;
}
