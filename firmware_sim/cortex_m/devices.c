/* devices.c: the registers of the machine's devices, which programs of any board reach at DEVICES_BASE.
 *
 *     0x40000000 board     identity, random numbers, local clock, promise, watchdog, end
 *     0x40001000 timer     32 compare channels on the local clock, interrupt 0
 *     0x40002000 plant     sensors and actuators
 *     0x40003000 values    parameters of the scenario
 *     0x40004000 records   counters, signals, events
 *     0x40005000 encoders, 0x40006000 PWM stages: motor.c
 *     0x40010000 port 0    FIFOs of frames; CAN mailboxes and filters; UART; interrupt 8; port p at + 0x1000 p
 *
 * A read is a function of the machine's state. What needs the world outside is a write, noted in the journal as a
 * command; commands with an answer, and all if computing takes time, stop the machine behind the instruction.
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
    RECORD_EVENT = 0x14, RECORD_MISTAKE = 0x18,

    PORT_KIND = 0x00, PORT_CONTROL = 0x04, PORT_FRAMES = 0x08, RX_LENGTH = 0x0C, RX_DATA = 0x10, RX_NEXT = 0x14,
    TX_DATA = 0x18, TX_SEND = 0x1C, TX_ROOM = 0x20, RX_LOST = 0x24, TX_OVERFLOW = 0x28,
    UART_DATA = 0x40, UART_STATUS = 0x44,
    CAN_TX = 0x80, CAN_REQUEST = 0x90, CAN_RX = 0xA0, CAN_FILTERS = 0xB0, CAN_FILTER = 0x100
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

static Command *command_bytes(Machine *m, CommandKind kind, uint32_t id, const void *data, uint32_t length)
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

/* --- ports */

static void update_line(Machine *m, uint32_t number)
{
    const PortState *port = &m->state.port[number];
    set_line(m, IRQ_PORT + number, port->control & 1u && port->rx_frames > 0, line_due_ns(m, IRQ_PORT + number));
}

/* Return the byte at `place` of the first frame waiting, 0 beyond its end. */
static uint32_t waiting_byte(const Machine *m, uint32_t number, uint32_t place)
{
    const PortState *port = &m->state.port[number];
    if (port->rx_frames == 0 || place >= port->frame[port->rx_head].length) {
        return 0;
    }
    return m->rx_bytes[number][(port->frame[port->rx_head].first + place) % RX_BYTES];
}

static uint32_t waiting_word(const Machine *m, uint32_t number, uint32_t place, unsigned size)
{
    uint32_t word = 0;
    for (unsigned i = 0; i < size; i++) {
        word |= waiting_byte(m, number, place + i) << 8 * i;
    }
    return word;
}

static void drop_first(Machine *m, uint32_t number)
{
    PortState *port = &m->state.port[number];
    if (port->rx_frames > 0) {
        port->rx_used -= port->frame[port->rx_head].length;
        port->rx_head = (port->rx_head + 1) % RX_FRAMES;
        port->rx_frames--;
        port->rx_read = 0;
        update_line(m, number);
    }
}

static uint32_t read_uart(Machine *m, uint32_t number)
{
    PortState *port = &m->state.port[number];
    const uint32_t byte = waiting_byte(m, number, port->rx_read);
    port->rx_read++;
    if (port->rx_frames > 0 && port->rx_read >= port->frame[port->rx_head].length) {
        drop_first(m, number);
    }
    return byte;
}

static uint32_t read_port(Machine *m, uint32_t number, uint32_t offset, unsigned size)
{
    PortState *port = &m->state.port[number];
    if (offset >= CAN_RX && offset < CAN_RX + 16) {
        return waiting_word(m, number, offset - CAN_RX, size);
    }
    switch (offset) {
    case PORT_KIND: return m->port_kind[number];
    case PORT_CONTROL: return port->control;
    case PORT_FRAMES: return port->rx_frames;
    case RX_LENGTH: return port->rx_frames > 0 ? port->frame[port->rx_head].length : 0u;
    case RX_DATA: {
        const uint32_t word = waiting_word(m, number, port->rx_read, size);
        port->rx_read += size;
        return word;
    }
    case TX_ROOM: return FRAME_BYTES - port->tx_length;
    case RX_LOST: return port->rx_lost;
    case TX_OVERFLOW: return port->tx_overflow;
    case UART_DATA: return read_uart(m, number);
    case UART_STATUS: return 2u | (port->rx_frames > 0 ? 1u : 0u);
    default: trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x10000u + 0x1000u * number + offset); return 0;
    }
}

static void fill(Machine *m, uint32_t number, uint32_t value, unsigned size)
{
    PortState *port = &m->state.port[number];
    for (unsigned i = 0; i < size; i++) {
        if (port->tx_length < FRAME_BYTES) {
            m->tx_bytes[number][port->tx_length++] = (uint8_t)(value >> 8 * i);
        } else {
            port->tx_overflow = 1;
        }
    }
}

/* Send the first `length` bytes of the FIFO and empty it; of an overflowed FIFO nothing is sent. */
static void send(Machine *m, uint32_t number, uint32_t length)
{
    PortState *port = &m->state.port[number];
    if (length <= port->tx_length && !port->tx_overflow) {
        command_bytes(m, SEND, number, m->tx_bytes[number], length);
    } else {
        port->tx_overflow = 1;
    }
    port->tx_length = 0;
}

static void write_port(Machine *m, uint32_t number, uint32_t offset, uint32_t value, unsigned size)
{
    PortState *port = &m->state.port[number];
    if (offset >= CAN_TX && offset < CAN_TX + 16 && size == 4) {
        port->can_tx[(offset - CAN_TX) / 4] = value;
        return;
    }
    if (offset >= CAN_FILTER && offset < CAN_FILTER + 8 * FILTERS && size == 4) {
        (offset & 4u ? port->filter_mask : port->filter_id)[(offset - CAN_FILTER) / 8] = value;
        return;
    }
    switch (offset) {
    case PORT_CONTROL:
        port->control = value & 1u;
        update_line(m, number);
        break;
    case RX_NEXT: drop_first(m, number); break;
    case TX_DATA: fill(m, number, value, size); break;
    case TX_SEND: send(m, number, value); break;
    case RX_LOST: port->rx_lost = 0; break;
    case TX_OVERFLOW: port->tx_overflow = 0; port->tx_length = 0; break;
    case UART_DATA: {
        const uint8_t byte = (uint8_t)value;
        command_bytes(m, SEND, number, &byte, 1);
        break;
    }
    case CAN_REQUEST: {
        uint8_t frame[16];
        memcpy(frame, port->can_tx, sizeof frame);
        frame[5] = frame[6] = frame[7] = 0;
        command_bytes(m, SEND, number, frame, sizeof frame);
        break;
    }
    case CAN_FILTERS: port->filters = value <= FILTERS ? value : FILTERS; break;
    default: trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x10000u + 0x1000u * number + offset);
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

static bool passes(const PortState *port, const uint8_t *data, uint32_t length)
{
    uint32_t identifier = 0;
    if (port->filters == 0 || length < 4) {
        return true;
    }
    memcpy(&identifier, data, 4);
    for (uint32_t i = 0; i < port->filters; i++) {
        if (((identifier ^ port->filter_id[i]) & port->filter_mask[i]) == 0) {
            return true;
        }
    }
    return false;
}

MACHINE_EXPORT void machine_receive(Machine *m, uint32_t number, const uint8_t *data, uint32_t length)
{
    PortState *port = &m->state.port[number];
    if (!passes(port, data, length)) {
        return;
    }
    if (port->rx_frames == RX_FRAMES || length > RX_BYTES - port->rx_used) {
        port->rx_lost++;
        return;
    }
    port->frame[(port->rx_head + port->rx_frames) % RX_FRAMES] = (Frame){ port->rx_next, length, m->state.present_ns };
    for (uint32_t i = 0; i < length; i++) {
        m->rx_bytes[number][(port->rx_next + i) % RX_BYTES] = data[i];
    }
    port->rx_next = (port->rx_next + length) % RX_BYTES;
    port->rx_used += length;
    port->rx_frames++;
    update_line(m, number);
}

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
