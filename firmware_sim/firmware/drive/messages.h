/* messages.h: the messages of drive.dbc in structs of SocketCAN; `unit` is added to every identifier. */
#ifndef MESSAGES_H
#define MESSAGES_H

#include <stdbool.h>
#include <stdint.h>
#include "marconet_can.h"

typedef enum { STOPPED, RUNNING, STALE } DriveState;
typedef enum { OTHER, UNREADABLE, REFUSED, SETPOINT } Heard;

typedef struct {
    double left_radps, right_radps;
    bool runs;
    uint8_t counter;
} Setpoint;

/* Read a struct of the port; SETPOINT with its values, or why there are none. */
Heard message_read(const uint8_t *bytes, uint32_t length, uint32_t unit, Setpoint *setpoint);

void message_speeds(uint8_t *bytes, uint32_t unit, double left_radps, double right_radps, DriveState state,
                    uint8_t counter);
void message_odometry(uint8_t *bytes, uint32_t unit, int32_t left_count, int32_t right_count);
void message_status(uint8_t *bytes, uint32_t unit, DriveState state, uint8_t counter, uint16_t refused,
                    uint32_t age_ms);

#endif
