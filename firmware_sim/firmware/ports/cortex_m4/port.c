/* port.c: marconet_board.h over the registers of the emulated Cortex-M4.
 *
 * Each call of the firmware is an interrupt's handler. All have one priority group, so that none preempts another; of
 * those that wait, arrivals precede timers. Between them the processor sleeps. */
#include <stdbool.h>
#include "board_ids.h"
#include "machine_registers.h"
#include "marconet_board.h"

typedef union {
    double real;
    int64_t integer;
    uint32_t word[2];
} Pair;

static int64_t now_ns;                  /* local time of the present call */
static bool starting = true;
static union {
    uint32_t words[BOARD_MAX_FRAME_BYTES / 4];
    uint8_t bytes[BOARD_MAX_FRAME_BYTES];
} received;

static void read_clock(void)
{
    Pair time;
    time.word[0] = CLOCK_LOW;
    time.word[1] = CLOCK_HIGH;
    now_ns = time.integer;
}

static void begin_call(void)
{
    CLOCK_CAPTURE = 1;
    read_clock();
}

void interrupt0_handler(void)
{
    const uint32_t rang = TIMER_STATUS;
    if (rang != 0) {
        uint32_t timer = 0;
        while (!(rang >> timer & 1u)) {
            timer++;
        }
        TIMER_STATUS = 1u << timer;
        begin_call();
        board_timer(timer);
    }
}

static void take_frame(uint32_t port)
{
    const uint32_t length = PORT_RX_LENGTH(port);
    for (uint32_t i = 0; 4 * i < length; i++) {
        received.words[i] = PORT_RX_DATA(port);     /* little endian, as the processor */
    }
    PORT_RX_NEXT(port) = 1;
    begin_call();
    board_receive(port, received.bytes, length);
}

void interrupt_handler(void) { take_frame(active_exception() - 16u - PERIPHERAL_PORT(0)); }

int main(void)
{
    SCB_AIRCR = 0x05FA0700u;                        /* one group: no handler preempts another */
    NVIC_PRIORITY(PERIPHERAL_TIMER) = 0x80;
    begin_call();
    const int32_t code = board_start();
    starting = false;
    if (code != 0) {
        RUN_END = (uint32_t)code;
    }
    for (uint32_t port = 0; port < PORTS_DECLARED; port++) {
        NVIC_PRIORITY(PERIPHERAL_PORT(port)) = 0x40;
        PORT_CONTROL(port) = 1;
        NVIC_ENABLE = 1u << PERIPHERAL_PORT(port);
    }
    NVIC_ENABLE = 1u << PERIPHERAL_TIMER;
    SCB_SCR = 2;                                    /* sleep when the last handler returns */
    forget_fpu();                                   /* main uses no FPU register from here on */
    for (;;) {
        wait_for_interrupt();
    }
}

/* --- the board's functions */

static int32_t mistake(const char *function, uint32_t number, BoardError code)
{
    while (*function != '\0') {
        RECORD_TEXT = (uint8_t)*function++;
    }
    RECORD_LOW = (uint32_t)code;
    RECORD_MISTAKE = number;
    return code;
}

int64_t board_now(void) { return now_ns; }

static int32_t select(const char *function, uint32_t timer)
{
    if (timer >= BOARD_TIMERS) {
        return mistake(function, timer, BOARD_UNKNOWN_ID);
    }
    TIMER_CHANNEL = timer;
    TIMER_STATUS = 1u << timer;                     /* one that rang and was not handled yet is set anew */
    return BOARD_OK;
}

static void set_compare(int64_t time)
{
    Pair pair;
    pair.integer = time;
    TIMER_LOW = pair.word[0];
    TIMER_HIGH = pair.word[1];
}

int32_t board_set_timer(uint32_t timer, int64_t local_ns, uint32_t flags)
{
    if (timer < BOARD_TIMERS && flags & ~BOARD_SILENT) {
        return BOARD_OUT_OF_RANGE;
    }
    const int32_t code = select("board_set_timer", timer);
    if (code == BOARD_OK) {
        set_compare(local_ns);
        TIMER_ARM = flags;
    }
    return code;
}

int32_t board_set_delay(uint32_t timer, int64_t delay_ns, uint32_t flags)
{
    if (timer < BOARD_TIMERS && (flags & ~BOARD_SILENT || delay_ns < 0)) {
        return BOARD_OUT_OF_RANGE;
    }
    const int32_t code = select("board_set_delay", timer);
    if (code == BOARD_OK) {
        set_compare(delay_ns);
        TIMER_DELAY = flags;
    }
    return code;
}

int32_t board_cancel_timer(uint32_t timer)
{
    const int32_t code = select("board_cancel_timer", timer);
    if (code == BOARD_OK) {
        TIMER_CANCEL = 1;
    }
    return code;
}

int32_t board_adjust_clock(int64_t step_ns, double trim_ppm)
{
    if (!(-1e6 < trim_ppm && trim_ppm < 1e6)) {
        return BOARD_OUT_OF_RANGE;
    }
    Pair step, trim;
    step.integer = step_ns;
    trim.real = trim_ppm;
    CLOCK_STEP_LOW = step.word[0];
    CLOCK_STEP_HIGH = step.word[1];
    CLOCK_TRIM_LOW = trim.word[0];
    CLOCK_TRIM_HIGH = trim.word[1];
    CLOCK_ADJUST = 1;
    read_clock();
    return BOARD_OK;
}

int32_t board_promise(int64_t local_ns, uint32_t flags)
{
    if (flags & ~BOARD_FIRM) {
        return BOARD_OUT_OF_RANGE;
    }
    Pair pair;
    pair.integer = local_ns;
    PROMISE_LOW = pair.word[0];
    PROMISE_HIGH = pair.word[1];
    PROMISE_GIVE = flags;
    return BOARD_OK;
}

int32_t board_send(uint32_t port, const uint8_t *data, uint32_t length)
{
    if (port >= PORTS_DECLARED) {
        return mistake("board_send", port, BOARD_UNKNOWN_ID);
    }
    if (starting) {
        return mistake("board_send", port, BOARD_NOT_NOW);
    }
    if (length > BOARD_MAX_FRAME_BYTES) {
        PORT_TX_SEND(port) = length;                /* the machine records that it was not sent */
        PORT_TX_OVERFLOW(port) = 0;
        return BOARD_TOO_LONG;
    }
    uint32_t i = 0;
    for (; i + 4 <= length; i += 4) {
        PORT_TX_DATA(port) = data[i] | (uint32_t)data[i + 1] << 8 | (uint32_t)data[i + 2] << 16
            | (uint32_t)data[i + 3] << 24;
    }
    for (; i < length; i++) {
        PORT_TX_BYTE(port) = data[i];
    }
    PORT_TX_SEND(port) = length;
    return BOARD_OK;
}

uint32_t board_random(void)
{
    RANDOM_DRAW = 1;
    return RANDOM_DATA;
}

int32_t board_sense(uint32_t sensor, double *value)
{
    if (sensor >= SENSORS_DECLARED) {
        return mistake("board_sense", sensor, BOARD_UNKNOWN_ID);
    }
    PLANT_SENSOR = sensor;
    const int32_t status = (int32_t)PLANT_STATUS;
    if (status == BOARD_OK) {
        Pair pair;
        pair.word[0] = PLANT_SENSE_LOW;
        pair.word[1] = PLANT_SENSE_HIGH;
        *value = pair.real;
    }
    return status;
}

int32_t board_actuate(uint32_t actuator, double value)
{
    if (actuator >= ACTUATORS_DECLARED) {
        return mistake("board_actuate", actuator, BOARD_UNKNOWN_ID);
    }
    Pair pair;
    pair.real = value;
    PLANT_ACTUATE_LOW = pair.word[0];
    PLANT_ACTUATE_HIGH = pair.word[1];
    PLANT_ACTUATOR = actuator;
    return BOARD_OK;
}

int32_t board_parameter_length(uint32_t parameter)
{
    if (parameter >= PARAMETERS_DECLARED) {
        return mistake("board_parameter_length", parameter, BOARD_UNKNOWN_ID);
    }
    VALUES_PARAMETER = parameter;
    return (int32_t)VALUES_LENGTH;
}

int32_t board_parameter(uint32_t parameter, uint32_t index, double *value)
{
    if (parameter >= PARAMETERS_DECLARED) {
        return mistake("board_parameter", parameter, BOARD_UNKNOWN_ID);
    }
    VALUES_PARAMETER = parameter;
    if (index >= VALUES_LENGTH) {
        return BOARD_NO_VALUE;
    }
    Pair pair;
    VALUES_INDEX = index;
    pair.word[0] = VALUES_LOW;
    pair.word[1] = VALUES_HIGH;
    *value = pair.real;
    return BOARD_OK;
}

int32_t board_count(uint32_t counter, uint32_t by)
{
    if (counter >= COUNTERS_DECLARED) {
        return mistake("board_count", counter, BOARD_UNKNOWN_ID);
    }
    RECORD_LOW = by;
    RECORD_HIGH = 0;
    RECORD_COUNTER = counter;
    return BOARD_OK;
}

int32_t board_record(uint32_t signal, double value)
{
    if (signal >= SIGNALS_DECLARED) {
        return mistake("board_record", signal, BOARD_UNKNOWN_ID);
    }
    Pair pair;
    pair.real = value;
    RECORD_LOW = pair.word[0];
    RECORD_HIGH = pair.word[1];
    RECORD_SIGNAL = signal;
    return BOARD_OK;
}

int32_t board_event(uint32_t event, const char *detail)
{
    if (event >= EVENTS_DECLARED) {
        return mistake("board_event", event, BOARD_UNKNOWN_ID);
    }
    for (uint32_t i = 0; i < BOARD_MAX_DETAIL_BYTES && detail[i] != '\0'; i++) {
        RECORD_TEXT = (uint8_t)detail[i];
    }
    RECORD_EVENT = event;
    return BOARD_OK;
}
