/* probe.c: does, in each of its timers, one of the things that a firmware may do; see test_activations.py. */
#include <stdint.h>
#include <time.h>
#include "board_ids.h"
#include "marconet_board.h"

enum { ORDER, READ, READ_TWICE, ADJUST, DRAW, MANY_CALLS, MANY_BYTES, TOO_LONG, WAIT, WAIT_LONG, ACT_AND_READ };

static volatile int64_t *word;
static uint8_t frame[BOARD_MAX_FRAME_BYTES + 1];

static void actuate(double value) { board_actuate(ACTUATOR_U, value); }

/* Wait until somebody else changes the word, for at most `limit_ms` of processor time of this process. */
static double waited(double limit_ms)
{
    const int64_t before = *word;
    const clock_t from = clock();
    while (*word == before) {
        if ((double)(clock() - from) > limit_ms * CLOCKS_PER_SEC / 1000.0) {
            return 0.0;
        }
    }
    return 1.0;
}

int32_t board_start(void)
{
    double value = 0.0, code = 0.0;
    board_parameter(PARAMETER_WORD, 0, &value);
    board_parameter(PARAMETER_CODE, 0, &code);
    word = (volatile int64_t *)(uintptr_t)value;
    board_count(COUNTER_CALLS, 1);
    return (int32_t)code;
}

void board_timer(uint32_t timer)
{
    double value = -1.0;
    switch (timer) {
    case ORDER:
        board_send(PORT_RADIO, (const uint8_t *)"a", 1);
        actuate(1.5);
        board_set_timer(3, board_now() + 5, BOARD_SILENT);
        board_send(PORT_RADIO, (const uint8_t *)"bc", 2);
        board_count(COUNTER_CALLS, 4000000000u);
        board_event(EVENT_TEXT, "done");
        break;
    case READ:
        actuate(board_sense(SENSOR_Y, &value) == BOARD_OK ? value : -4.0);
        break;
    case READ_TWICE:
        actuate(board_sense(SENSOR_Y, &value) + board_sense(SENSOR_Y + 1, &value));
        *word += 1;
        break;
    case ADJUST:
        board_adjust_clock(7, 0.5);
        actuate((double)board_now());
        break;
    case DRAW:
        actuate((double)board_random());
        break;
    case MANY_CALLS:
        for (uint32_t k = 0; k < 300; k++) {
            actuate((double)k);
        }
        break;
    case MANY_BYTES:
        for (uint32_t k = 0; k < 20; k++) {
            frame[0] = (uint8_t)k;
            board_send(PORT_RADIO, frame, BOARD_MAX_FRAME_BYTES);
        }
        break;
    case TOO_LONG:
        actuate(board_send(PORT_RADIO, frame, BOARD_MAX_FRAME_BYTES + 1));
        break;
    case WAIT:
        actuate(waited(100.0));
        break;
    case WAIT_LONG:
        actuate(waited(10000.0));
        break;
    case ACT_AND_READ:
        actuate(1.0);
        board_sense(SENSOR_Y, &value);
        actuate(2.0);
        *word += 1;
        break;
    default:
        break;
    }
}

void board_receive(uint32_t port, const uint8_t *data, uint32_t length)
{
    board_record(SIGNAL_LENGTH, (double)length);
    board_send(port, data, length);
}
