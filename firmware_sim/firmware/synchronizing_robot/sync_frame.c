/* sync_frame.c: see sync_frame.h. */
#include "sync_frame.h"
#include <string.h>

enum { MAGIC = 0xD5 };
static const uint64_t EXPONENT = 0x7FF0000000000000u;       /* all bits set: infinite or not a number */

static void put(uint8_t *bytes, uint64_t value, uint32_t count)
{
    for (uint32_t k = 0; k < count; k++) {
        bytes[k] = (uint8_t)(value >> (8u * k));
    }
}

static uint64_t taken(const uint8_t *bytes, uint32_t count)
{
    uint64_t value = 0;
    for (uint32_t k = 0; k < count; k++) {
        value |= (uint64_t)bytes[k] << (8u * k);
    }
    return value;
}

uint32_t sync_frame_pack(const Team *team, int64_t slot, const double *outputs, uint8_t *bytes)
{
    bytes[0] = MAGIC;
    bytes[1] = (uint8_t)team->number;
    put(bytes + 2, (uint64_t)slot, 4);
    for (uint32_t k = 0; k < team->outputs; k++) {
        uint64_t bits;
        memcpy(&bits, outputs + k, sizeof bits);
        put(bytes + 6 + 8 * k, bits, 8);
    }
    return 6 + 8 * team->outputs;
}

bool sync_frame_unpack(const Team *team, const uint8_t *bytes, uint32_t length, SyncFrame *frame)
{
    if (length != 6 + 8 * team->outputs || bytes[0] != MAGIC || bytes[1] >= team->robots) {
        return false;
    }
    frame->sender = bytes[1];
    frame->slot = (int64_t)taken(bytes + 2, 4);
    for (uint32_t k = 0; k < team->outputs; k++) {
        const uint64_t bits = taken(bytes + 6 + 8 * k, 8);
        if ((bits & EXPONENT) == EXPONENT) {
            return false;
        }
        memcpy(frame->outputs + k, &bits, sizeof bits);
    }
    return true;
}
