/* look_frames.h: the two frames of a look, as agents/tracking/look_frames.py; little endian.
 *
 *     request   magic, number of the look                                                     3 bytes
 *     answer    magic, number of the look, x, y [m], theta [rad], v [m/s], omega [rad/s]     43 bytes
 *
 * R2 sends an answer with the number UNASKED, without a request, when its inputs change. */
#ifndef LOOK_FRAMES_H
#define LOOK_FRAMES_H

#include <stdbool.h>
#include <stdint.h>
#include "controller.h"

#define UNASKED 0xFFFFu
enum { REQUEST_BYTES = 3, ANSWER_BYTES = 43 };

typedef struct {
    uint32_t look;
    Pose pose;
    Velocities inputs;          /* nominal */
} Answer;

/* Return the number that a look has in its frames. */
uint32_t look_number(int64_t look);

void request_pack(int64_t look, uint8_t *bytes);

/* Read an answer; return false for a frame that is cut, too long or not finite. */
bool answer_unpack(const uint8_t *bytes, uint32_t length, Answer *answer);

#endif
