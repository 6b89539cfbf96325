/* drive_link.h: the companion's side of the messages of drive.dbc, as agents/tracking/drive_link.py.
 *
 *     left, right = (v -+ omega b / 2) / r        wheel speeds for a command, r wheel radius, b track
 *
 * A setpoint is confirmed when the running drive sends a status with its number: then the wheels follow it. */
#ifndef DRIVE_LINK_H
#define DRIVE_LINK_H

#include <stdbool.h>
#include <stdint.h>
#include "controller.h"
#include "marconet_can.h"

typedef enum { UNREADABLE, OTHER, ANGLES, CONFIRMED } DriveMessage;

typedef struct {
    double radius, half_track;          /* [m] */
    double rad_per_count;
    uint8_t number;                     /* of the last setpoint, modulo 256 */
    bool has_counts;
    uint32_t left_raw, right_raw;       /* last counts, modulo 2^32 */
    int64_t left_count, right_count;    /* since the first message */
    double left, right;                 /* angles of the wheels [rad] */
    uint8_t confirmed;                  /* number of the setpoint in force */
} DriveLink;

void drive_link_init(DriveLink *link, double radius, double track, double counts_per_turn);

/* Make the frame of the next setpoint, whose number is then `link->number`. */
void drive_link_setpoint(DriveLink *link, Velocities command, uint8_t bytes[CAN_BYTES]);

/* Read a frame of the bus into `left` and `right` or `confirmed`, and return which. */
DriveMessage drive_link_read(DriveLink *link, const uint8_t *bytes, uint32_t length);

#endif
