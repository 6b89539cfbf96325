/* marconet_host.h: the memory that a firmware on the host shares with its node's process.
 *
 *     process  --now, id, length-->                       board_timer, board_receive, ...  (marconet_host.c)
 *     firmware --question, asked_...--> ask(context)      --code, asked_real--> firmware
 *     firmware --call, bytes-->                           the process carries the calls out
 *
 * Included by marconet_host.c, a part of each firmware, and by bound_activations.c, a part of marconet; the numbers and
 * the layout are also in operations.py and ctypes_activations.py. A process loads only firmware that was built with
 * the same files.
 */
#ifndef MARCONET_HOST_H
#define MARCONET_HOST_H

#include <stdint.h>

enum { CALLS = 256, BYTES = 16384 };

typedef enum { SEND, SET_TIMER, SET_DELAY, CANCEL, PROMISE, ACTUATE, COUNT, EVENT, MISTAKE } Operation;
typedef enum { HAND_OVER, ADJUST_CLOCK, SENSE, RANDOM } Question;

typedef struct {
    uint32_t operation;
    uint32_t id;
    int64_t integer;        /* time; length in `bytes`, of a frame that was too long its negative; number to count */
    int64_t place;          /* first byte in `bytes`; flags of a timer */
    double real;            /* value; code of a mistake */
} Call;

/* Invariants: calls <= CALLS; the bytes of a call lie within `bytes`; an id is less than the number declared. */
typedef struct {
    int64_t now;
    uint32_t id;                /* timer or port of the activation */
    uint32_t length;            /* of the frame that arrived */
    uint32_t calls;
    int32_t code;               /* result of `board_start`; BoardError of the answer to the last question */
    uint32_t question;
    uint32_t asked_id;
    int64_t asked_integer;
    double asked_real;          /* of the question, then its answer */
    void (*ask)(void *context); /* answers the question */
    void *context;
    Call call[CALLS];
    uint8_t bytes[BYTES];
} Host;

#endif
