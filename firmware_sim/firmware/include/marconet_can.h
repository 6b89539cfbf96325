/* marconet_can.h: the frames of a CAN port as structs of SocketCAN, little endian: 16 bytes, with CAN FD 72.
 *
 *     identifier and flags (u32) | length (u8) | 3 bytes | data, 8 or 64 bytes
 *
 * A header of plain C; it needs no board. */
#ifndef MARCONET_CAN_H
#define MARCONET_CAN_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum { CAN_BYTES = 16, CAN_FD_BYTES = 72 };

typedef struct {
    uint32_t identifier;
    bool extended, remote, error, fd;
    uint32_t length;            /* of `data`, 0 for a remote frame */
    const uint8_t *data;        /* within the struct that was read */
} CanFrame;

/* Return the `count` bytes at `bytes` as a number, the lowest byte first. */
static inline uint32_t little_endian(const uint8_t *bytes, uint32_t count)
{
    uint32_t value = 0;
    while (count-- > 0) {
        value = value << 8 | bytes[count];
    }
    return value;
}

static inline void put_little_endian(uint8_t *bytes, uint64_t value, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++) {
        bytes[k] = (uint8_t)(value >> (8u * k));
    }
}

/* Read a struct of a port; return false for bytes that are none. */
static inline bool can_read(const uint8_t *bytes, uint32_t length, CanFrame *frame)
{
    static const uint8_t FD_LENGTHS[] = { 12, 16, 20, 24, 32, 48, 64 };
    if (length != CAN_BYTES && length != CAN_FD_BYTES) {
        return false;
    }
    const uint32_t word = little_endian(bytes, 4);
    frame->fd = length == CAN_FD_BYTES;
    frame->extended = (word & 0x80000000u) != 0;
    frame->remote = (word & 0x40000000u) != 0;
    frame->error = (word & 0x20000000u) != 0;
    frame->identifier = word & 0x1FFFFFFFu;
    frame->length = frame->remote ? 0 : bytes[4];
    frame->data = bytes + 8;
    bool fits = bytes[4] <= 8;
    for (uint32_t k = 0; frame->fd && k < sizeof FD_LENGTHS; k++) {
        fits |= bytes[4] == FD_LENGTHS[k];
    }
    return fits && !(frame->remote && frame->fd)
           && (frame->identifier <= 0x7FFu || frame->extended || frame->error);
}

/* Make `bytes`, CAN_BYTES of them, the struct of a data frame with 8 zeros and a short identifier. */
static inline void can_begin(uint8_t *bytes, uint32_t identifier)
{
    memset(bytes, 0, CAN_BYTES);
    put_little_endian(bytes, identifier, 4);
    bytes[4] = 8;
}

#endif
