/* marconet_host.c: the board of a firmware that runs as a shared library in its node's process.
 *
 *     host_timer --> board_timer(host.id) --board_send, board_actuate, ...--> `host` --> the process
 *
 * What the firmware asks for waits in `host.call` until its function returns; the process then carries it out, in
 * order, at the same instant. The functions that need an answer of the process (`host.ask`) hand it over before.
 * Numbers pass in both directions in `host`, not as arguments, since ctypes converts each argument of a call.
 */
#include <stdbool.h>
#include <stddef.h>
#include <string.h>
#include "board_ids.h"
#include "marconet_board.h"
#include "marconet_host.h"

static Host host;
static double signals[SIGNALS_DECLARED + 1u];
static const double *values;            /* of all parameters, one after the other */
static const uint32_t *first;           /* place of a parameter's first value; the last entry is the end */
static volatile int64_t *runs;          /* read by a watching process: the function that runs, 0 between calls */
static int64_t starting_runs, timer_runs, receive_runs;     /* what `runs` says of them */
static int64_t now_runs;                /* what `runs` is to say after a question */
static uint32_t bytes_used;
static bool starting;

BOARD_EXPORT void *host_memory(void);
BOARD_EXPORT void *host_bytes(void);
BOARD_EXPORT void *host_signals(void);
BOARD_EXPORT void host_prepare(const double *parameters, const uint32_t *places, int64_t *word, int64_t start,
                               int64_t timer, int64_t receive);
BOARD_EXPORT int host_start(void);      /* these return the number of calls in the journal */
BOARD_EXPORT int host_timer(void);
BOARD_EXPORT int host_receive(const uint8_t *data);

void *host_memory(void) { return &host; }

void *host_bytes(void) { return host.bytes; }

void *host_signals(void) { return signals; }

/* Called once, before any other function; the memory stays where it is. */
void host_prepare(const double *parameters, const uint32_t *places, int64_t *word, int64_t start, int64_t timer,
                  int64_t receive)
{
    values = parameters;
    first = places;
    runs = word;
    starting_runs = start;
    timer_runs = timer;
    receive_runs = receive;
}

static void begin(int64_t function)
{
    host.calls = bytes_used = 0;
    *runs = now_runs = function;
}

static int end(void)
{
    *runs = 0;
    return (int)host.calls;
}

int host_start(void)
{
    begin(starting_runs);
    starting = true;
    const int32_t code = board_start();
    starting = false;
    host.code = code;
    return end();
}

int host_timer(void)
{
    begin(timer_runs);
    board_timer(host.id);
    return end();
}

int host_receive(const uint8_t *data)
{
    begin(receive_runs);
    board_receive(host.id, data, host.length);
    return end();
}

/* --- the journal of calls */

static int32_t ask(Question question, uint32_t id, int64_t integer, double *real)
{
    host.question = question;
    host.asked_id = id;
    host.asked_integer = integer;
    host.asked_real = *real;
    host.ask(host.context);                         /* it carries out the calls so far */
    *runs = now_runs;                               /* a plant that was stepped has noted its own calls */
    host.calls = bytes_used = 0;
    if (host.code == BOARD_OK) {
        *real = host.asked_real;
    }
    return host.code;
}

/* Return the next call, with a copy of `length` bytes; if there is no room, the process carries out those so far. */
static Call *next(Operation operation, uint32_t id, const void *data, uint32_t length)
{
    if (host.calls == CALLS || bytes_used + length > BYTES) {
        double unused = 0.0;
        ask(HAND_OVER, 0, 0, &unused);
    }
    Call *call = &host.call[host.calls++];
    call->operation = operation;
    call->id = id;
    call->integer = length;
    call->place = bytes_used;
    call->real = 0.0;
    if (length > 0) {
        memcpy(host.bytes + bytes_used, data, length);
        bytes_used += length;
    }
    return call;
}

/* Note a mistake of the program in a call of `function`, which ends the run when the firmware's function returns. */
static int32_t mistake(const char *function, uint32_t id, BoardError code)
{
    next(MISTAKE, id, function, (uint32_t)strlen(function))->real = code;
    return code;
}

static bool known(uint32_t id, uint32_t declared) { return id < declared; }

/* --- the board's functions */

int64_t board_now(void) { return host.now; }

static int32_t arm(Operation operation, uint32_t timer, int64_t time, uint32_t flags)
{
    if (!known(timer, BOARD_TIMERS)) {
        return mistake(operation == SET_TIMER ? "board_set_timer" : operation == SET_DELAY ? "board_set_delay"
                       : "board_cancel_timer", timer, BOARD_UNKNOWN_ID);
    }
    if (flags & ~BOARD_SILENT || (operation == SET_DELAY && time < 0)) {
        return BOARD_OUT_OF_RANGE;
    }
    Call *call = next(operation, timer, NULL, 0);
    call->integer = time;
    call->place = flags;
    return BOARD_OK;
}

int32_t board_set_timer(uint32_t timer, int64_t local_ns, uint32_t flags)
{
    return arm(SET_TIMER, timer, local_ns, flags);
}

int32_t board_set_delay(uint32_t timer, int64_t delay_ns, uint32_t flags)
{
    return arm(SET_DELAY, timer, delay_ns, flags);
}

int32_t board_cancel_timer(uint32_t timer) { return arm(CANCEL, timer, 0, 0); }

int32_t board_adjust_clock(int64_t step_ns, double trim_ppm)
{
    if (!(-1e6 < trim_ppm && trim_ppm < 1e6)) {
        return BOARD_OUT_OF_RANGE;
    }
    return ask(ADJUST_CLOCK, 0, step_ns, &trim_ppm);
}

int32_t board_promise(int64_t local_ns, uint32_t flags)
{
    if (flags & ~BOARD_FIRM) {
        return BOARD_OUT_OF_RANGE;
    }
    next(PROMISE, flags, NULL, 0)->integer = local_ns;
    return BOARD_OK;
}

int32_t board_send(uint32_t port, const uint8_t *data, uint32_t length)
{
    if (!known(port, PORTS_DECLARED)) {
        return mistake("board_send", port, BOARD_UNKNOWN_ID);
    }
    if (starting) {
        return mistake("board_send", port, BOARD_NOT_NOW);
    }
    if (length > BOARD_MAX_FRAME_BYTES) {
        next(SEND, port, NULL, 0)->integer = -(int64_t)length;      /* the board records that it was not sent */
        return BOARD_TOO_LONG;
    }
    next(SEND, port, data, length);
    return BOARD_OK;
}

uint32_t board_random(void)
{
    double bits = 0.0;
    ask(RANDOM, 0, 0, &bits);
    return (uint32_t)bits;
}

int32_t board_sense(uint32_t sensor, double *value)
{
    if (!known(sensor, SENSORS_DECLARED)) {
        return mistake("board_sense", sensor, BOARD_UNKNOWN_ID);
    }
    double read = 0.0;
    const int32_t code = ask(SENSE, sensor, 0, &read);
    if (code == BOARD_OK) {
        *value = read;
    }
    return code;
}

int32_t board_actuate(uint32_t actuator, double value)
{
    if (!known(actuator, ACTUATORS_DECLARED)) {
        return mistake("board_actuate", actuator, BOARD_UNKNOWN_ID);
    }
    next(ACTUATE, actuator, NULL, 0)->real = value;
    return BOARD_OK;
}

int32_t board_parameter_length(uint32_t parameter)
{
    if (!known(parameter, PARAMETERS_DECLARED)) {
        return mistake("board_parameter_length", parameter, BOARD_UNKNOWN_ID);
    }
    return (int32_t)(first[parameter + 1] - first[parameter]);
}

int32_t board_parameter(uint32_t parameter, uint32_t index, double *value)
{
    if (!known(parameter, PARAMETERS_DECLARED)) {
        return mistake("board_parameter", parameter, BOARD_UNKNOWN_ID);
    }
    if (index >= first[parameter + 1] - first[parameter]) {
        return BOARD_NO_VALUE;
    }
    *value = values[first[parameter] + index];
    return BOARD_OK;
}

int32_t board_count(uint32_t counter, uint32_t by)
{
    if (!known(counter, COUNTERS_DECLARED)) {
        return mistake("board_count", counter, BOARD_UNKNOWN_ID);
    }
    next(COUNT, counter, NULL, 0)->integer = by;
    return BOARD_OK;
}

int32_t board_record(uint32_t signal, double value)
{
    if (!known(signal, SIGNALS_DECLARED)) {
        return mistake("board_record", signal, BOARD_UNKNOWN_ID);
    }
    signals[signal] = value;
    return BOARD_OK;
}

int32_t board_event(uint32_t event, const char *detail)
{
    if (!known(event, EVENTS_DECLARED)) {
        return mistake("board_event", event, BOARD_UNKNOWN_ID);
    }
    uint32_t length = 0;
    while (length < BOARD_MAX_DETAIL_BYTES && detail[length] != '\0') {
        length++;
    }
    next(EVENT, event, detail, length);
    return BOARD_OK;
}
