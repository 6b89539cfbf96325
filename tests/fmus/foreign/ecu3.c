/* A control unit as an FMI 3.0 FMU with a bus terminal, after the text of FMI-LS-BUS 1.0.0 (CAN, low cut); written without
 * fmus/fmi. Its parameters say what it does:
 *
 *   period_ms > 0    transmit identifier `id` with 8 bytes, a counter, at offset_ms + k period_ms
 *   echo_ms >= 0     answer each frame received with the same data and the identifier + 1, echo_ms later
 *   retry            transmit a frame again that lost arbitration
 *   count_errors     count errors as a CAN controller does, and tell its state by Status
 *   script           values of Tx_Data: for each (delay after the last in us u32, length u32, bytes), little endian
 *   log              file with a line "time_ns hex" for each value of Rx_Data
 *
 * KIND of Tx_Clock: 0 countdown, 1 constant, 2 fixed, 3 tunable, 4 changing, 5 triggered output. Kinds 1 to 3 tick every
 * `tick_ms`, kind 3 twice as often from 10 ms on. It returns an error for a call that its mode does not allow. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifndef KIND
#define KIND 0
#endif
#define API __attribute__((visibility("default")))
#define ROOM 4096
#define ITEMS 64
#define ITEM_BYTES 512
#define CLOSE 0.6e-9
enum { RX_DATA, TX_DATA, RX_CLOCK, TX_CLOCK, PERIOD, OFFSET, ID, ECHO, RETRY, COUNT, SCRIPT, LOG, TICK, TEC, HEARD, NOTIFY };
enum { NEW, CONFIGURING, INITIALIZING, EVENT, STEP, BROKEN };
typedef uint32_t VR;
typedef struct { double at; uint32_t size; uint8_t data[ITEM_BYTES]; } Item;
typedef struct {
    int mode, tec, status, ticks;
    double time, period, offset, id, echo, tick, heard, told, last_tick;
    bool retry, count, notify, rx_active, tx_active, asked, told_fast;
    int64_t sent;
    Item items[ITEMS];
    int n_items;
    Item last;
    uint8_t out[ROOM], *script;
    size_t n_out, n_script, at_script;
    double script_s;
    char log[1024];
} Ecu;

static int fail(Ecu *c) { c->mode = BROKEN; return 3; }
static uint32_t u32(const uint8_t *p) { return p[0] | p[1] << 8 | p[2] << 16 | (uint32_t)p[3] << 24; }
static void put32(uint8_t *p, uint32_t v) { for (int k = 0; k < 4; k++) p[k] = (uint8_t)(v >> 8 * k); }

static void later(Ecu *c, double at, const uint8_t *data, uint32_t size)
{
    if (c->n_items == ITEMS || size > ITEM_BYTES)
        return;
    Item *item = &c->items[c->n_items++];
    item->at = at;
    item->size = size;
    memcpy(item->data, data, size);
}

static void status(Ecu *c, int state)
{
    uint8_t op[9] = {0x41, 0, 0, 0, 9, 0, 0, 0, (uint8_t)state};
    if (state != c->status && c->count)
        later(c, c->time, op, 9);
    c->status = state;
}

static void count(Ecu *c, int by)
{
    c->tec = c->tec + by < 0 ? 0 : c->tec + by;
    status(c, c->tec > 255 ? 3 : c->tec > 127 ? 2 : 1);
}

static double script_due(const Ecu *c)
{
    return c->at_script + 8 <= c->n_script ? c->script_s + u32(c->script + c->at_script) * 1e-6 : INFINITY;
}

static double frame_due(const Ecu *c)
{
    return c->period > 0 && c->status != 3 ? (c->offset + c->sent * c->period) * 1e-3 : INFINITY;
}

static double due(const Ecu *c)
{
    double next = fmin(script_due(c), frame_due(c));
    for (int k = 0; k < c->n_items; k++)
        next = fmin(next, c->items[k].at);
    return next;
}

static void emit(Ecu *c, const uint8_t *data, size_t size)
{
    if (c->n_out + size > ROOM)
        return;
    memcpy(c->out + c->n_out, data, size);
    c->n_out += size;
}

/* Fill Tx_Data with all that is due. */
static void fill(Ecu *c)
{
    c->n_out = 0;
    while (script_due(c) <= c->time + CLOSE) {
        const uint32_t size = u32(c->script + c->at_script + 4);
        c->script_s = script_due(c);
        emit(c, c->script + c->at_script + 8, size);
        c->at_script += 8 + size;
    }
    while (frame_due(c) <= c->time + CLOSE) {
        uint8_t op[24] = {0x10, 0, 0, 0, 24};
        put32(op + 8, (uint32_t)c->id);
        op[14] = 8;
        put32(op + 16, (uint32_t)c->sent++);
        emit(c, op, 24);
        memcpy(c->last.data, op, 24);
        c->last.size = 24;
    }
    int kept = 0;
    for (int k = 0; k < c->n_items; k++)
        if (c->items[k].at <= c->time + CLOSE)
            emit(c, c->items[k].data, c->items[k].size);
        else
            c->items[kept++] = c->items[k];
    c->n_items = kept;
}

static void hear(Ecu *c, const uint8_t *p, size_t size)
{
    FILE *file = c->log[0] ? fopen(c->log, "a") : NULL;
    if (file) {
        fprintf(file, "%.0f ", c->time * 1e9);
        for (size_t k = 0; k < size; k++)
            fprintf(file, "%02x", p[k]);
        fprintf(file, "\n");
        fclose(file);
    }
    for (size_t at = 0; at + 8 <= size; at += u32(p + at + 4)) {
        const uint32_t op = u32(p + at), length = u32(p + at + 4);
        uint8_t answer[ITEM_BYTES];
        if ((op == 0x10 || op == 0x11) && c->echo >= 0 && length <= ITEM_BYTES) {
            memcpy(answer, p + at, length);
            put32(answer + 8, u32(p + at + 8) + 1);
            later(c, c->time + c->echo * 1e-3, answer, length);
        }
        c->heard += op == 0x10 || op == 0x11;
        if (op == 0x30 && c->retry && c->last.size)
            later(c, c->time, c->last.data, c->last.size);
        if (op == 0x20)
            count(c, -1);
        if (op == 0x31 && p[at + 14])
            count(c, 8);
    }
}

API const char *fmi3GetVersion(void) { return "3.0"; }
API void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *where, bool visible, bool logging,
                                      bool event_mode, bool early, const VR need[], size_t n_need, void *env,
                                      void *logger, void *update)
{
    (void)name, (void)where, (void)visible, (void)logging, (void)need, (void)env, (void)logger, (void)update;
    if (strcmp(token, "ecu") || !event_mode || !early || n_need)
        return NULL;
    Ecu *c = calloc(1, sizeof(Ecu));
    c->id = 0x100;
    c->echo = -1;
    c->tick = 5;
    c->status = 1;
    c->told = INFINITY;
    return c;
}
API void fmi3FreeInstance(void *v) { free(((Ecu *)v)->script); free(v); }
API int fmi3EnterConfigurationMode(void *v) { ((Ecu *)v)->mode = CONFIGURING; return 0; }
API int fmi3ExitConfigurationMode(void *v) { ((Ecu *)v)->mode = NEW; return 0; }
API int fmi3EnterInitializationMode(void *v, bool a, double b, double t0, bool d, double e)
{
    (void)a, (void)b, (void)d, (void)e, (void)t0;
    ((Ecu *)v)->mode = INITIALIZING;
    return 0;
}
API int fmi3ExitInitializationMode(void *v) { ((Ecu *)v)->mode = EVENT; return 0; }
API int fmi3EnterEventMode(void *v)
{
    Ecu *c = v;
    if (c->mode != STEP)
        return fail(c);
    c->mode = EVENT;
    if (KIND == 5 && due(c) <= c->time + CLOSE)
        c->tx_active = true;
    return 0;
}
API int fmi3EnterStepMode(void *v)
{
    Ecu *c = v;
    if (c->mode != EVENT)
        return fail(c);
    c->mode = STEP;
    return 0;
}
API int fmi3Terminate(void *v) { (void)v; return 0; }
API int fmi3UpdateDiscreteStates(void *v, bool *again, bool *end, bool *nominals, bool *values, bool *next, double *time)
{
    Ecu *c = v;
    if (c->mode != EVENT)
        return fail(c);
    *again = *end = *nominals = *values = *next = false;
    *time = 0;
    c->rx_active = c->tx_active = false;
    return 0;
}
API int fmi3SetClock(void *v, const VR r[], size_t n, const bool on[])
{
    Ecu *c = v;
    if (c->mode != EVENT)
        return fail(c);
    for (size_t k = 0; k < n; k++) {
        if (r[k] == RX_CLOCK) {
            c->rx_active = on[k];
        } else if (r[k] == TX_CLOCK && KIND != 5 && on[k]) {
            c->tx_active = true;
            c->ticks++;
            c->last_tick = c->time;
            c->told = INFINITY;
            fill(c);
        } else {
            return fail(c);
        }
    }
    return 0;
}
API int fmi3GetClock(void *v, const VR r[], size_t n, bool on[])
{
    Ecu *c = v;
    if (c->mode != EVENT || KIND != 5)
        return fail(c);
    for (size_t k = 0; k < n; k++) {
        on[k] = r[k] == TX_CLOCK && c->tx_active;
        if (on[k])
            fill(c);
        c->tx_active = false;
    }
    return 0;
}
API int fmi3GetIntervalDecimal(void *v, const VR r[], size_t n, double interval[], int qualifier[])
{
    Ecu *c = v;
    if (c->mode != EVENT || n != 1 || r[0] != TX_CLOCK)
        return fail(c);
    qualifier[0] = 1;
#ifdef STUCK
    interval[0] = 0;
    qualifier[0] = 2;
    return 0;
#endif
    if (KIND == 0) {
        const double at = due(c);
        if (at < c->told - CLOSE || at > c->told + CLOSE) {
            c->told = at;
            interval[0] = isinf(at) ? 0 : fmax(0, at - c->time);
            qualifier[0] = isinf(at) ? 0 : 2;
        }
    } else if (KIND == 4) {
        interval[0] = fmax(1e-9, fmin(1.0, due(c) - c->time));
        qualifier[0] = 2;
    } else if (!c->asked || (KIND == 3 && c->time >= 0.01 - CLOSE && !c->told_fast)) {
        c->told_fast = c->asked;
        interval[0] = c->tick * (c->asked ? 0.5e-3 : 1e-3);
        c->asked = true;
        qualifier[0] = 2;
    }
    return 0;
}
API int fmi3SetBinary(void *v, const VR r[], size_t n, const size_t sizes[], const uint8_t *const values[], size_t m)
{
    Ecu *c = v;
    if (n != 1 || m != 1)
        return fail(c);
    if (r[0] == SCRIPT && c->mode == NEW) {
        free(c->script);
        c->script = malloc(sizes[0] + 1);
        memcpy(c->script, values[0], sizes[0]);
        c->n_script = sizes[0];
        return 0;
    }
    if (r[0] != RX_DATA || c->mode != EVENT || !c->rx_active)
        return fail(c);
    hear(c, values[0], sizes[0]);
    return 0;
}
API int fmi3GetBinary(void *v, const VR r[], size_t n, size_t sizes[], const uint8_t *values[], size_t m)
{
    Ecu *c = v;
    if (n != 1 || m != 1 || r[0] != TX_DATA || c->mode != EVENT)
        return fail(c);
    sizes[0] = c->n_out;
    values[0] = c->out;
    return 0;
}
static double *number(Ecu *c, VR r)
{
    return r == PERIOD ? &c->period : r == OFFSET ? &c->offset : r == ID ? &c->id : r == ECHO ? &c->echo
         : r == TICK ? &c->tick : r == HEARD ? &c->heard : NULL;
}
API int fmi3SetFloat64(void *v, const VR r[], size_t n, const double in[], size_t m)
{
    (void)m;
    for (size_t k = 0; k < n; k++)
        *number(v, r[k]) = in[k];
    return 0;
}
API int fmi3GetFloat64(void *v, const VR r[], size_t n, double out[], size_t m)
{
    Ecu *c = v;
    (void)m;
    for (size_t k = 0; k < n; k++)
        out[k] = r[k] == TEC ? c->tec : *number(c, r[k]);
    return 0;
}
API int fmi3SetBoolean(void *v, const VR r[], size_t n, const bool in[], size_t m)
{
    Ecu *c = v;
    (void)m;
    for (size_t k = 0; k < n; k++) {
        if (r[k] == NOTIFY && c->mode != CONFIGURING)
            return fail(c);
        *(r[k] == RETRY ? &c->retry : r[k] == COUNT ? &c->count : &c->notify) = in[k];
    }
    return 0;
}
API int fmi3GetBoolean(void *v, const VR r[], size_t n, bool out[], size_t m)
{
    Ecu *c = v;
    (void)m, (void)n, (void)r;
    out[0] = c->notify;
    return 0;
}
API int fmi3SetString(void *v, const VR r[], size_t n, const char *const in[], size_t m)
{
    (void)r, (void)n, (void)m;
    snprintf(((Ecu *)v)->log, sizeof ((Ecu *)v)->log, "%s", in[0]);
    return 0;
}
API int fmi3DoStep(void *v, double t, double h, bool prior, bool *event, bool *end, bool *early, double *last)
{
    Ecu *c = v;
    (void)prior;
    if (c->mode != STEP || fabs(t - c->time) > CLOSE || h <= 0)
        return fail(c);
    *event = *end = *early = false;
    c->time = *last = t + h;
#ifdef EARLY
    if (t < EARLY - CLOSE && t + h > EARLY + CLOSE) {      /* an event of its own, which it has not announced */
        c->time = *last = EARLY;
        *event = *early = true;
    }
#endif
    if (KIND == 5)
        *event = due(c) <= c->time + CLOSE;
    return 0;
}
