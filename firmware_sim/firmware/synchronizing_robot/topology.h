/* topology.h: the source of the topology, told beforehand or discovered by flooding; as
 * agents/synchronization/told_topology.py and discovered_topology.py. All times are local [ns]. */
#ifndef TOPOLOGY_H
#define TOPOLOGY_H

#include "slots.h"
#include "team.h"

void topology_init(const Team *team);

/* Take received bytes that are no sync frame, sent at `sent_ns` if they are a control frame; false: unreadable. */
bool topology_heard_control(const Team *team, const Slots *slots, const uint8_t *bytes, uint32_t length,
                            int64_t sent_ns);

/* Called before the robot broadcasts in slot `slot`; `heard`: since its last slot. */
void topology_before_own_slot(const Team *team, const Slots *slots, int64_t slot, Robots heard);

/* Whether received frames show that others count slots differently; the robot then falls back. */
bool topology_out_of_step(void);
void topology_fell_back(void);

/* Whether the robot has to send in its next control sub-slot. */
bool topology_wants_control(const Team *team, const Slots *slots);

/* Write the frame for the control sub-slot that begins now; return its length, 0: send nothing. */
uint32_t topology_control_frame(const Team *team, const Slots *slots, int64_t local_ns, uint8_t *bytes);

/* The end of a round at which the robot has to call `topology_adopt`; false if none is known yet. */
bool topology_adoption_ns(const Team *team, const Slots *slots, int64_t local_ns, int64_t *at_ns);

/* Write the links that hold from now on to `heard`; false if the old ones stay. */
bool topology_adopt(const Team *team, int64_t at_ns, Robots *heard);

#endif
