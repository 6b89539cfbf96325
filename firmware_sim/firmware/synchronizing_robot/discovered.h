/* discovered.h: a topology discovered over the radio whenever received frames contradict the known one.
 *
 * A contradiction is a frame of a neighbour missing N^D + 1 times in a row in its slot, or a frame from a robot that is
 * no neighbour. The robot evaluates what it received when it wakes for a slot of its own: that keeps its promise. */
#ifndef DISCOVERED_H
#define DISCOVERED_H

#include "slots.h"
#include "team.h"

void discovered_init(const Team *team);
bool discovered_heard(const Team *team, const Slots *slots, const uint8_t *bytes, uint32_t length, int64_t sent_ns);
void discovered_before_own_slot(const Team *team, const Slots *slots, int64_t slot, Robots heard);
bool discovered_out_of_step(void);
void discovered_fell_back(void);
bool discovered_wants_control(void);
uint32_t discovered_control_frame(const Team *team, const Slots *slots, int64_t local_ns, uint8_t *bytes);
bool discovered_adoption_ns(const Team *team, const Slots *slots, int64_t *at_ns);
bool discovered_adopt(const Team *team, Robots *heard);

#endif
