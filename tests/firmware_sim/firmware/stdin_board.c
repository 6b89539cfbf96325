/* stdin_board.c: a board for sanitizers. It delivers frames from its standard input, each behind its length as two bytes
 * little endian, lets a timer that is armed ring after each, and prints the number of frames sent. */
#include <stdio.h>
#include <stdlib.h>
#include "board_ids.h"
#include "marconet_board.h"

static int64_t now_ns;
static unsigned sent;
static int armed[BOARD_TIMERS];

int64_t board_now(void) { return now_ns; }
int32_t board_set_timer(uint32_t timer, int64_t local_ns, uint32_t flags) { (void)local_ns, (void)flags; armed[timer] = 1; return 0; }
int32_t board_cancel_timer(uint32_t timer) { armed[timer] = 0; return 0; }
int32_t board_sense(uint32_t sensor, double *value) { *value = (double)sensor * 1e3; return 0; }
int32_t board_actuate(uint32_t actuator, double value) { (void)actuator, (void)value; return 0; }
int32_t board_parameter(uint32_t parameter, uint32_t index, double *value) { (void)parameter, (void)index; *value = 1.0; return 0; }
int32_t board_count(uint32_t counter, uint32_t by) { (void)counter, (void)by; return 0; }
int32_t board_event(uint32_t event, const char *detail) { (void)event, (void)detail; return 0; }

int32_t board_send(uint32_t port, const uint8_t *data, uint32_t length)
{
    unsigned sum = port;
    for (uint32_t i = 0; i < length; i++) {
        sum += data[i];                 /* read each byte, so that a sanitizer looks at it */
    }
    sent += sum > 0;
    return 0;
}

int main(void)
{
    board_start();
    for (uint32_t frames = 0;; frames++) {
        const int low = getchar(), high = getchar();
        if (high == EOF) {
            break;
        }
        const size_t length = (size_t)low | (size_t)high << 8;
        uint8_t *frame = malloc(length + (length == 0));        /* its end is guarded */
        if (fread(frame, 1, length, stdin) != length) {
            return 2;
        }
        now_ns += 1000000;
        board_receive(0, frame, (uint32_t)length);
        if (armed[frames % 5]) {
            armed[frames % 5] = 0;
            board_timer(frames % 5);
        }
        free(frame);
    }
    printf("%u\n", sent);
    return 0;
}
