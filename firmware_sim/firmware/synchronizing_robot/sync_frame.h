/* sync_frame.h: the frame in which a robot broadcasts its output, little endian:
 *
 *     magic u8 (0xD5) | sender u8 | slot number u32 | one float64 per output */
#ifndef SYNC_FRAME_H
#define SYNC_FRAME_H

#include "team.h"

enum { SYNC_FRAME_BYTES = 6 + 8 * MAX_VALUES };

typedef struct {
    uint32_t sender;
    int64_t slot;               /* 0 <= slot < 2^32 */
    double outputs[MAX_VALUES];
} SyncFrame;

/* Return the length of the frame written to `bytes`. */
uint32_t sync_frame_pack(const Team *team, int64_t slot, const double *outputs, uint8_t *bytes);

/* False for bytes that are cut, too long, not finite or from an unknown sender. */
bool sync_frame_unpack(const Team *team, const uint8_t *bytes, uint32_t length, SyncFrame *frame);

#endif
