/* ports.c: the registers of ports: FIFOs of frames, CAN mailboxes and filters, UART. Port p is at 0x40010000 + 0x1000 p.
 *
 * Frames that arrive wait in a ring; interrupt 8 + p is asked for while any does and the program has enabled it.
 */
#include "machine.h"
#include <string.h>

enum {
    PORT_KIND = 0x00, PORT_CONTROL = 0x04, PORT_FRAMES = 0x08, RX_LENGTH = 0x0C, RX_DATA = 0x10, RX_NEXT = 0x14,
    TX_DATA = 0x18, TX_SEND = 0x1C, TX_ROOM = 0x20, RX_LOST = 0x24, TX_OVERFLOW = 0x28,
    UART_DATA = 0x40, UART_STATUS = 0x44,
    CAN_TX = 0x80, CAN_REQUEST = 0x90, CAN_RX = 0xA0, CAN_FILTERS = 0xB0, CAN_FILTER = 0x100
};

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

uint32_t read_port(Machine *m, uint32_t number, uint32_t offset, unsigned size)
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

/* Send the first `length` bytes of the FIFO and empty it; of an overflowed FIFO nothing is sent: a negative length. */
static void send(Machine *m, uint32_t number, uint32_t length)
{
    PortState *port = &m->state.port[number];
    if (length <= port->tx_length && !port->tx_overflow) {
        command_bytes(m, SEND, number, m->tx_bytes[number], length);
    } else {
        port->tx_overflow = 1;
        command(m, SEND, number, -(int64_t)length);
    }
    port->tx_length = 0;
}

void write_port(Machine *m, uint32_t number, uint32_t offset, uint32_t value, unsigned size)
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
