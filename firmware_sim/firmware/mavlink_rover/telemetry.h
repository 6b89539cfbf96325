/* telemetry.h: what the rover says of itself, each message at an interval of its own on the local clock. */
#ifndef TELEMETRY_H
#define TELEMETRY_H

#include "link.h"

enum { STREAMS = 4 };                   /* they take the timers 0 to STREAMS - 1 */

/* Read the rates and arm the timers of all streams that are on. */
void telemetry_start(void);

/* Send the stream's message, since its timer has rung, and arm the timer again. */
void telemetry_due(uint32_t stream);

/* Send the message with this number once; return whether there is one. */
bool telemetry_send(uint32_t message);

/* Send the message with this number every `interval_us`; -1: never, 0: as at the start. Return a MAV_RESULT. */
uint8_t telemetry_set_interval(float message, float interval_us);

#endif
