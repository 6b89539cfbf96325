/* discovery.h: topology discovery by flooding over directed links (section 6.3.1), as agents/synchronization/discovery.py
 * and discovery_frame.py, where the end of an epoch is derived.
 *
 *     SILENT --trigger--> ARMED --own control slot--> RUNNING --end cycle--> SILENT
 *     SILENT, ARMED or RUNNING --a frame of a newer epoch--> RUNNING
 *
 * The frame, little endian:
 *
 *     magic u8 | version u8 | sender u8 | robots u8 | epoch u16 | start cycle u32 | per robot: the set that it hears */
#ifndef DISCOVERY_H
#define DISCOVERY_H

#include "team.h"

enum { DISCOVERY_BYTES = 10 + 2 * MAX_ROBOTS };

typedef enum { SILENT, ARMED, RUNNING } Phase;
typedef enum { NONE, COMPLETE, INCOMPLETE } Outcome;

typedef struct {
    uint32_t sender;
    uint16_t epoch;
    int64_t start_cycle;
    Robots records[MAX_ROBOTS];
} DiscoveryFrame;

typedef struct {
    uint32_t node, size;
    int64_t cycles, flood_cycles;   /* of an epoch; of its end, in which no node extends its own record */
    Phase phase;
    uint16_t epoch;
    int64_t start_cycle;
    Robots records[MAX_ROBOTS];     /* records[i]: those that i hears */
    Outcome outcome;
} Discovery;

void discovery_init(Discovery *discovery, const Team *team, int64_t join_delay_cycles);

/* Start a new discovery; without effect while one runs or is about to. */
void discovery_trigger(Discovery *discovery, int64_t cycle);

/* Drop the running epoch; begin a new one at the next own control slot. */
void discovery_abandon(Discovery *discovery);

bool discovery_decode(const Discovery *discovery, const uint8_t *bytes, uint32_t length, DiscoveryFrame *frame);

/* Whether a frame in the control slot of `owner` can be from a node that counts slots alike. */
bool discovery_fits(const Discovery *discovery, const DiscoveryFrame *frame, uint32_t owner, int64_t cycle);

/* Write the frame for this node's control slot of `cycle`; return its length, 0: send nothing. */
uint32_t discovery_frame_to_send(Discovery *discovery, int64_t cycle, uint8_t *bytes);

/* Apply bytes received in `cycle` in the control slot of `owner`; return whether they are the running epoch's. */
bool discovery_hear(Discovery *discovery, uint32_t owner, const uint8_t *bytes, uint32_t length, int64_t cycle);

/* The first cycle after the epoch, the same at all nodes. */
int64_t discovery_end_cycle(const Discovery *discovery);

/* Return the outcome of the epoch that has ended. */
Outcome discovery_finish(Discovery *discovery);

/* The nodes that a path of links leads to from `node`. */
Robots discovery_reached_from(const Discovery *discovery, uint32_t node);

#endif
