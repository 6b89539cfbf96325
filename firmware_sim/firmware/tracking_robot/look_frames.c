/* look_frames.c: see look_frames.h. */
#include "look_frames.h"
#include "marconet_functions.h"

static const uint8_t ASKS = 0xA5, ANSWERS = 0xA6;

uint32_t look_number(int64_t look) { return (uint32_t)(look % (int64_t)UNASKED); }

void request_pack(int64_t look, uint8_t *bytes)
{
    const uint32_t number = look_number(look);
    bytes[0] = ASKS;
    bytes[1] = (uint8_t)number;
    bytes[2] = (uint8_t)(number >> 8);
}

static double real(const uint8_t *bytes)
{
    uint64_t bits = 0;
    for (uint32_t k = 0; k < 8; k++) {
        bits |= (uint64_t)bytes[k] << 8 * k;
    }
    return from_bits(bits);
}

bool answer_unpack(const uint8_t *bytes, uint32_t length, Answer *answer)
{
    double value[5], sum = 0.0;
    if (length != ANSWER_BYTES || bytes[0] != ANSWERS) {
        return false;
    }
    for (uint32_t k = 0; k < 5; k++) {
        value[k] = real(bytes + 3 + 8 * k);
        sum += magnitude(value[k]);
    }
    if (!(sum <= 1.7976931348623157e308)) {
        return false;
    }
    answer->look = (uint32_t)bytes[1] | (uint32_t)bytes[2] << 8;
    answer->pose.x = value[0];
    answer->pose.y = value[1];
    answer->pose.theta = value[2];
    answer->inputs.v = value[3];
    answer->inputs.omega = value[4];
    return true;
}
