/* devices.c: the registers of the machine's devices, which programs of any board reach at DEVICES_BASE.
 *
 *     0x40000000 board     identity, random numbers, local clock, promise, watchdog, end
 *     0x40001000 timer     32 compare channels on the local clock, interrupt 0
 *     0x40002000 plant     sensors and actuators
 *     0x40003000 values    parameters of the scenario
 *     0x40004000 records   counters, signals, events
 *     0x40005000 encoders, 0x40006000 PWM stages: motor.c
 *     0x40010000 port 0; port p at + 0x1000 p: ports.c
 *
 * A read is a function of the machine's state. What needs the world outside is a write, noted in the journal as a
 * command; commands with an answer, and all if computing takes time, stop the machine behind the instruction. In a run
 * by blocks they are answered at once.
 */
#include "machine.h"
#include <string.h>

enum {
    BOARD_ID = 0x00, BOARD_UNIQUE = 0x04, BOARD_RESET_CAUSE = 0x14, RANDOM_DRAW = 0x20, RANDOM_DATA = 0x24,
    CLOCK_CAPTURE = 0x30, CLOCK_LOW = 0x34, CLOCK_HIGH = 0x38, CLOCK_STEP_LOW = 0x40, CLOCK_STEP_HIGH = 0x44,
    CLOCK_TRIM_LOW = 0x48, CLOCK_TRIM_HIGH = 0x4C, CLOCK_ADJUST = 0x50, PROMISE_LOW = 0x60, PROMISE_HIGH = 0x64,
    PROMISE_GIVE = 0x68, WATCHDOG_FEED = 0x70, RUN_END = 0x74,

    TIMER_CHANNEL = 0x00, TIMER_LOW = 0x04, TIMER_HIGH = 0x08, TIMER_ARM = 0x0C, TIMER_DELAY = 0x10, TIMER_CANCEL = 0x14,
    TIMER_STATUS = 0x18,

    SENSOR = 0x00, SENSE_STATUS = 0x04, SENSE_LOW = 0x08, SENSE_HIGH = 0x0C, ACTUATE_LOW = 0x10, ACTUATE_HIGH = 0x14,
    ACTUATOR = 0x18,

    VALUES_PARAMETER = 0x00, VALUES_INDEX = 0x04, VALUES_LENGTH = 0x08, VALUES_LOW = 0x0C, VALUES_HIGH = 0x10,

    RECORD_LOW = 0x00, RECORD_HIGH = 0x04, RECORD_SIGNAL = 0x08, RECORD_COUNTER = 0x0C, RECORD_TEXT = 0x10,
    RECORD_EVENT = 0x14, RECORD_MISTAKE = 0x18
};

static void put_low(int64_t *pair, uint32_t value) { *pair = (int64_t)(((uint64_t)*pair & ~0xFFFFFFFFull) | value); }
static void put_high(int64_t *pair, uint32_t value)
{
    *pair = (int64_t)(((uint64_t)*pair & 0xFFFFFFFFull) | (uint64_t)value << 32);
}
static uint32_t low(int64_t pair) { return (uint32_t)(uint64_t)pair; }
static uint32_t high(int64_t pair) { return (uint32_t)((uint64_t)pair >> 32); }

static double as_real(int64_t pair)
{
    double real;
    memcpy(&real, &pair, sizeof real);
    return real;
}

static int64_t as_pair(double real)
{
    int64_t pair;
    memcpy(&pair, &real, sizeof pair);
    return pair;
}

/* --- commands */

static bool is_full(const Machine *m)
{
    return m->report.commands >= COMMANDS - 8 || m->journal.bytes_used >= COMMAND_BYTES - 4 * FRAME_BYTES;
}

/* Return whether there is room for a command and a frame. A block of code may have more commands than there is room for:
 * they are handed over. What follows the end of a run, or an error, is not noted. */
static bool has_room(Machine *m)
{
    if (m->report.commands == 0) {
        m->journal.bytes_used = 0;
    }
    if (m->by_blocks && is_full(m) && !m->ends) {
        m->ask(HAND_OVER, 0, 0, 0.0);
        m->journal.bytes_used = m->report.commands == 0 ? 0 : m->journal.bytes_used;
    }
    return !m->by_blocks || !is_full(m);
}

static Command *note(Machine *m, CommandKind kind, uint32_t id, int64_t integer)
{
    Command *noted = m->journal.command + m->report.commands;
    m->report.commands++;
    m->report.others += kind > MISTAKE;
    *noted = (Command){ kind, id, integer, 0, 0.0 };
    m->ends |= kind == END || kind == RESTART;
    if (kind >= END || m->each_command_stops || is_full(m)) {
        need_attention(m);      /* an IT block holds three more instructions at most */
    }
    return noted;
}

Command *command(Machine *m, CommandKind kind, uint32_t id, int64_t integer)
{
    return has_room(m) ? note(m, kind, id, integer) : &m->dropped;
}

Command *command_bytes(Machine *m, CommandKind kind, uint32_t id, const void *data, uint32_t length)
{
    if (!has_room(m)) {
        return &m->dropped;
    }
    const uint32_t place = m->journal.bytes_used;
    memcpy(m->journal.bytes + place, data, length);
    m->journal.bytes_used += length;
    Command *noted = note(m, kind, id, length);
    noted->place = place;
    return noted;
}

/* Carry out a request with an answer: by `m->ask`, or by a command at which the machine stops. */
void request(Machine *m, CommandKind kind, uint32_t id, int64_t integer, double real)
{
    if (m->ask == NULL) {
        command(m, kind, id, integer)->real = real;
    } else if (!m->ends) {                      /* else this block of code has ended its run before */
        const double value = m->ask(kind, id, integer, real);
        machine_answer(m, kind, m->report.status, value, m->report.local_ns);
    }
}

void request_reset(Machine *m) { command(m, RESTART, 0, 0); }

/* --- board */

static uint32_t read_board(Machine *m, uint32_t offset)
{
    const State *s = &m->state;
    switch (offset) {
    case BOARD_ID: return 0x344D434Du;                          /* "MCM4" */
    case BOARD_UNIQUE: case BOARD_UNIQUE + 4: case BOARD_UNIQUE + 8: case BOARD_UNIQUE + 12:
        return m->id[(offset - BOARD_UNIQUE) / 4];
    case BOARD_RESET_CAUSE: return s->reset_cause;
    case RANDOM_DATA: return s->random_value;
    case CLOCK_LOW: return low(s->local_ns);
    case CLOCK_HIGH: return high(s->local_ns);
    default: trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + offset); return 0;
    }
}

static void write_board(Machine *m, uint32_t offset, uint32_t value)
{
    State *s = &m->state;
    switch (offset) {
    case RANDOM_DRAW: request(m, RANDOM, 0, 0, 0.0); break;
    case CLOCK_CAPTURE:
        if (m->each_command_stops) {
            command(m, CAPTURE, 0, 0);
        }
        break;
    case CLOCK_STEP_LOW: put_low(&s->clock_step, value); break;
    case CLOCK_STEP_HIGH: put_high(&s->clock_step, value); break;
    case CLOCK_TRIM_LOW: put_low(&s->clock_trim, value); break;
    case CLOCK_TRIM_HIGH: put_high(&s->clock_trim, value); break;
    case CLOCK_ADJUST: request(m, ADJUST_CLOCK, 0, s->clock_step, as_real(s->clock_trim)); break;
    case PROMISE_LOW: put_low(&s->promise_until, value); break;
    case PROMISE_HIGH: put_high(&s->promise_until, value); break;
    case PROMISE_GIVE: command(m, PROMISE, value, s->promise_until); break;
    case WATCHDOG_FEED: command(m, WATCHDOG, 0, value); break;
    case RUN_END: command(m, END, value, 0); break;
    default: trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + offset);
    }
}

/* --- interrupts */

int64_t line_due_ns(const Machine *m, uint32_t interrupt)
{
    const State *s = &m->state;
    int64_t due = s->present_ns;
    if (interrupt == IRQ_TIMER) {
        for (uint32_t channel = 0; channel < TIMERS; channel++) {
            if (s->timer_status >> channel & 1u && s->rang_ns[channel] < due) {
                due = s->rang_ns[channel];
            }
        }
    } else if (interrupt >= IRQ_PORT && interrupt - IRQ_PORT < PORTS && s->port[interrupt - IRQ_PORT].rx_frames > 0) {
        const PortState *port = &s->port[interrupt - IRQ_PORT];
        due = port->frame[port->rx_head].arrived_ns;
    }
    return due;
}

/* --- timer */

static uint32_t read_timer(Machine *m, uint32_t offset)
{
    if (offset == TIMER_STATUS) {
        return m->state.timer_status;
    }
    trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x1000u + offset);
    return 0;
}

static void write_timer(Machine *m, uint32_t offset, uint32_t value)
{
    State *s = &m->state;
    switch (offset) {
    case TIMER_CHANNEL: s->timer_channel = value % TIMERS; break;
    case TIMER_LOW: put_low(&s->timer_compare, value); break;
    case TIMER_HIGH: put_high(&s->timer_compare, value); break;
    case TIMER_ARM: command(m, SET_TIMER, s->timer_channel, s->timer_compare)->place = value; break;
    case TIMER_DELAY: command(m, SET_DELAY, s->timer_channel, s->timer_compare)->place = value; break;
    case TIMER_CANCEL: command(m, CANCEL_TIMER, s->timer_channel, 0); break;
    case TIMER_STATUS:
        s->timer_status &= ~value;
        set_line(m, IRQ_TIMER, s->timer_status != 0, line_due_ns(m, IRQ_TIMER));
        break;
    default: trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x1000u + offset);
    }
}

/* --- plant, values, records */

static uint32_t read_plant(Machine *m, uint32_t offset)
{
    const State *s = &m->state;
    switch (offset) {
    case SENSE_STATUS: return s->sense_status;
    case SENSE_LOW: return low(s->sense_value);
    case SENSE_HIGH: return high(s->sense_value);
    default: trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x2000u + offset); return 0;
    }
}

static void write_plant(Machine *m, uint32_t offset, uint32_t value)
{
    State *s = &m->state;
    switch (offset) {
    case SENSOR: request(m, SENSE, value, 0, 0.0); break;
    case ACTUATE_LOW: put_low(&s->actuate_value, value); break;
    case ACTUATE_HIGH: put_high(&s->actuate_value, value); break;
    case ACTUATOR: command(m, ACTUATE, value, 0)->real = as_real(s->actuate_value); break;
    default: trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x2000u + offset);
    }
}

static uint32_t read_values(Machine *m, uint32_t offset)
{
    const State *s = &m->state;
    const bool known = s->parameter < m->parameters;
    const uint32_t first = known ? m->first_value[s->parameter] : 0u;
    const uint32_t length = known ? m->first_value[s->parameter + 1] - first : 0u;
    const int64_t value = s->parameter_index < length ? as_pair(m->values[first + s->parameter_index]) : 0;
    switch (offset) {
    case VALUES_LENGTH: return length;
    case VALUES_LOW: return low(value);
    case VALUES_HIGH: return high(value);
    default: trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x3000u + offset); return 0;
    }
}

static void write_values(Machine *m, uint32_t offset, uint32_t value)
{
    switch (offset) {
    case VALUES_PARAMETER: m->state.parameter = value; break;
    case VALUES_INDEX: m->state.parameter_index = value; break;
    default: trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x3000u + offset);
    }
}

static void write_records(Machine *m, uint32_t offset, uint32_t value)
{
    State *s = &m->state;
    switch (offset) {
    case RECORD_LOW: put_low(&s->record_value, value); break;
    case RECORD_HIGH: put_high(&s->record_value, value); break;
    case RECORD_SIGNAL: command(m, RECORD, value, 0)->real = as_real(s->record_value); break;
    case RECORD_COUNTER: command(m, COUNT, value, s->record_value); break;
    case RECORD_TEXT:
        if (s->detail_length < DETAIL_BYTES) {
            m->detail[s->detail_length++] = (uint8_t)value;
        }
        break;
    case RECORD_EVENT:
        command_bytes(m, EVENT, value, m->detail, s->detail_length);
        s->detail_length = 0;
        break;
    case RECORD_MISTAKE:
        command_bytes(m, MISTAKE, value, m->detail, s->detail_length)->real = (int32_t)low(s->record_value);
        s->detail_length = 0;
        break;
    default: trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x4000u + offset);
    }
}

/* --- for machine.c */

uint64_t read_device(uc_engine *uc, uint64_t offset, unsigned size, void *user)
{
    Machine *m = user;
    const uint32_t page = (uint32_t)offset >> 12, place = (uint32_t)offset & 0xFFFu;
    (void)uc;
    if (page >= 16 && page - 16 < m->ports) {
        return read_port(m, page - 16, place, size);
    }
    switch (page) {
    case 0: return read_board(m, place);
    case 1: return read_timer(m, place);
    case 2: return read_plant(m, place);
    case 3: return read_values(m, place);
    case 5: return read_encoder(m, place);
    case 6: return read_pwm(m, place);
    default: trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + (uint32_t)offset); return 0;
    }
}

void write_device(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user)
{
    Machine *m = user;
    const uint32_t page = (uint32_t)offset >> 12, place = (uint32_t)offset & 0xFFFu, word = (uint32_t)value;
    (void)uc;
    if (page >= 16 && page - 16 < m->ports) {
        write_port(m, page - 16, place, word, size);
        return;
    }
    switch (page) {
    case 0: write_board(m, place, word); break;
    case 1: write_timer(m, place, word); break;
    case 2: write_plant(m, place, word); break;
    case 3: write_values(m, place, word); break;
    case 4: write_records(m, place, word); break;
    case 5: write_encoder(m, place, word); break;
    case 6: write_pwm(m, place, word); break;
    default: trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + (uint32_t)offset);
    }
}

/* --- for machine.py: what happens to the board */

MACHINE_EXPORT void machine_ring(Machine *m, uint32_t channel)
{
    if (!(m->state.timer_status >> channel & 1u)) {
        m->state.timer_status |= 1u << channel;
        m->state.rang_ns[channel] = m->state.present_ns;
    }
    set_line(m, IRQ_TIMER, true, m->state.present_ns);
}

MACHINE_EXPORT void machine_answer(Machine *m, uint32_t kind, int32_t status, double real, int64_t local_ns)
{
    State *s = &m->state;
    s->local_ns = local_ns;
    if (kind == RANDOM) {
        s->random_value = (uint32_t)real;
    } else if (kind == SENSE) {
        s->sense_status = (uint32_t)status;
        s->sense_value = as_pair(real);
    } else if (kind == ENCODER) {
        capture_encoder(m, real);
    }
}
