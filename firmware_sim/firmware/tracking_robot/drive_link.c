/* drive_link.c: see drive_link.h. */
#include "drive_link.h"
#include "marconet_functions.h"
#include "marconet_numbers.h"

static const uint32_t SETPOINT_ID = 272, SPEED_ID = 400, ODOMETRY_ID = 416, STATUS_ID = 1808;
static const double RADPS_PER_BIT = 0.0001, SETPOINT_MAX_RADPS = 500.0, SPEED_MAX_RADPS = 838.0;
enum { RUN = 1, RUNNING = 1, STATES = 3, MODES = 2 };

void drive_link_init(DriveLink *link, double radius, double track, double counts_per_turn)
{
    memset(link, 0, sizeof *link);
    link->radius = radius;
    link->half_track = track / 2.0;
    link->rad_per_count = 2.0 * MARCONET_PI / counts_per_turn;
}

static uint64_t speed_bits(double radps)
{
    const double most = SETPOINT_MAX_RADPS;
    return (uint64_t)rounded((radps > most ? most : radps < -most ? -most : radps) / RADPS_PER_BIT);
}

void drive_link_setpoint(DriveLink *link, Velocities command, uint8_t bytes[CAN_BYTES])
{
    const double turn = command.omega * link->half_track;
    link->number++;
    can_begin(bytes, SETPOINT_ID);
    put_little_endian(bytes + 8, speed_bits((command.v - turn) / link->radius), 3);
    put_little_endian(bytes + 11, speed_bits((command.v + turn) / link->radius), 3);
    bytes[14] = RUN;
    bytes[15] = link->number;
}

static bool admitted(const uint8_t *bytes, double most)
{
    const int32_t raw = (int32_t)little_endian(bytes, 3);
    const double radps = (double)(raw >= 0x800000 ? raw - 0x1000000 : raw) * RADPS_PER_BIT;
    return -most <= radps && radps <= most;
}

/* Counts are modulo 2^32; between two messages a wheel turns less than half of that. */
static void add_counts(int64_t *count, uint32_t *raw, uint32_t now, bool first)
{
    *count += first ? 0 : (int32_t)(now - *raw);
    *raw = now;
}

DriveMessage drive_link_read(DriveLink *link, const uint8_t *bytes, uint32_t length)
{
    CanFrame frame;
    if (!can_read(bytes, length, &frame)) {
        return UNREADABLE;
    }
    const uint32_t id = frame.identifier;
    if (frame.extended || frame.error
        || (id != SETPOINT_ID && id != SPEED_ID && id != ODOMETRY_ID && id != STATUS_ID)) {
        return OTHER;
    }
    if (frame.remote || frame.fd || frame.length != 8) {
        return UNREADABLE;
    }
    const uint8_t *data = frame.data;
    if (id == STATUS_ID) {
        return data[0] < STATES ? OTHER : UNREADABLE;
    }
    if (id == ODOMETRY_ID) {
        add_counts(&link->left_count, &link->left_raw, little_endian(data, 4), !link->has_counts);
        add_counts(&link->right_count, &link->right_raw, little_endian(data + 4, 4), !link->has_counts);
        link->has_counts = true;
        link->left = (double)link->left_count * link->rad_per_count;
        link->right = (double)link->right_count * link->rad_per_count;
        return ANGLES;
    }
    const double most = id == SPEED_ID ? SPEED_MAX_RADPS : SETPOINT_MAX_RADPS;
    if (!admitted(data, most) || !admitted(data + 3, most) || data[6] >= (id == SPEED_ID ? STATES : MODES)) {
        return UNREADABLE;
    }
    if (id == SETPOINT_ID || data[6] != RUNNING) {
        return OTHER;
    }
    link->confirmed = data[7];
    return CONFIRMED;
}
