/* link.h: the serial port as a MAVLink channel, by the library that MAVLink's generator writes (`mavlink` in
 * firmware.toml). Frames go out as MAVLink 2; MAVLink 1 is read too.
 *
 * Not there: signatures are neither made nor checked. */
#ifndef LINK_H
#define LINK_H

#include <stdbool.h>
#include <stdint.h>

#define MAVLINK_COMM_NUM_BUFFERS 1
#define MAVLINK_NO_CONVERSION_HELPERS   /* they need sqrtf */
#define MAVLINK_NO_SIGN_PACKET
#define MAVLINK_NO_SIGNATURE_CHECK
#define HAVE_MAVLINK_SHA256             /* none: it is for signatures */
#define MAVLINK_SEPARATE_HELPERS        /* the library's variables exist once, in link.c */
#include <common/mavlink.h>

extern mavlink_system_t mavlink_system; /* who this rover is */

void link_send(const mavlink_message_t *message);

/* Take the next byte from the port; return whether it completes a message to this rover, which is then in `message`. */
bool link_take(uint8_t byte, mavlink_message_t *message);

#endif
