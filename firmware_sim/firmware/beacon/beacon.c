/* beacon.c: one frame in every period of the local clock; it holds the number of frames before it, little endian. */
#include "board_ids.h"
#include "marconet_board.h"

enum { TIMER_PERIOD = 0 };

static int64_t period_ns;
static int64_t next_ns;
static uint32_t sent;

int32_t board_start(void)
{
    double value;
    if (board_parameter(PARAMETER_PERIOD_NS, 0, &value) != BOARD_OK) {
        return 1;
    }
    period_ns = (int64_t)value;
    next_ns = board_now();
    board_set_timer(TIMER_PERIOD, next_ns, 0);
    return 0;
}

void board_timer(uint32_t timer)
{
    (void)timer;
    const uint8_t frame[4] = { (uint8_t)sent, (uint8_t)(sent >> 8), (uint8_t)(sent >> 16), (uint8_t)(sent >> 24) };
    board_send(PORT_RADIO, frame, sizeof frame);
    board_record(SIGNAL_SENT, (double)++sent);
    next_ns += period_ns;
    board_set_timer(TIMER_PERIOD, next_ns, 0);
}

void board_receive(uint32_t port, const uint8_t *data, uint32_t length)
{
    (void)port;
    (void)data;
    (void)length;
    board_count(COUNTER_FRAMES_HEARD, 1);
}
