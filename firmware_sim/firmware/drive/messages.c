/* messages.c: see messages.h. */
#include "messages.h"
#include "marconet_can.h"
#include "marconet_numbers.h"

static const uint32_t SETPOINT_ID = 272, SPEED_ID = 400, ODOMETRY_ID = 416, STATUS_ID = 1808;
static const double RADPS_PER_BIT = 0.0001, SETPOINT_MAX_RADPS = 500.0, SPEED_MAX_RADPS = 838.0;

static double speed(const uint8_t *bytes)
{
    const uint32_t raw = little_endian(bytes, 3);
    return (double)(raw >= 0x800000u ? (int32_t)raw - 0x1000000 : (int32_t)raw) * RADPS_PER_BIT;
}

static bool admitted(double radps) { return -SETPOINT_MAX_RADPS <= radps && radps <= SETPOINT_MAX_RADPS; }

Heard message_read(const uint8_t *bytes, uint32_t length, uint32_t unit, Setpoint *setpoint)
{
    CanFrame frame;
    if (!can_read(bytes, length, &frame)) {
        return UNREADABLE;
    }
    if (frame.extended || frame.error || frame.identifier != SETPOINT_ID + unit) {
        return OTHER;
    }
    const uint8_t *data = frame.data;
    setpoint->left_radps = speed(data);
    setpoint->right_radps = speed(data + 3);
    setpoint->runs = data[6] == 1;
    setpoint->counter = data[7];
    if (frame.fd || frame.remote || frame.length != 8 || data[6] > 1 || !admitted(setpoint->left_radps)
        || !admitted(setpoint->right_radps)) {
        return REFUSED;
    }
    return SETPOINT;
}

static uint64_t bits(double radps)
{
    const double most = SPEED_MAX_RADPS;
    const double sent = radps > most ? most : radps < -most ? -most : radps;
    return (uint64_t)rounded(sent / RADPS_PER_BIT);
}

void message_speeds(uint8_t *bytes, uint32_t unit, double left_radps, double right_radps, DriveState state,
                    uint8_t counter)
{
    can_begin(bytes, SPEED_ID + unit);
    put_little_endian(bytes + 8, bits(left_radps), 3);
    put_little_endian(bytes + 11, bits(right_radps), 3);
    bytes[14] = (uint8_t)state;
    bytes[15] = counter;
}

void message_odometry(uint8_t *bytes, uint32_t unit, int32_t left_count, int32_t right_count)
{
    can_begin(bytes, ODOMETRY_ID + unit);
    put_little_endian(bytes + 8, (uint32_t)left_count, 4);
    put_little_endian(bytes + 12, (uint32_t)right_count, 4);
}

void message_status(uint8_t *bytes, uint32_t unit, DriveState state, uint8_t counter, uint16_t refused,
                    uint32_t age_ms)
{
    can_begin(bytes, STATUS_ID + unit);
    bytes[8] = (uint8_t)state;
    bytes[9] = counter;
    put_little_endian(bytes + 10, refused, 2);
    put_little_endian(bytes + 12, age_ms, 4);
}
