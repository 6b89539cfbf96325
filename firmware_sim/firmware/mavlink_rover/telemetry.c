/* telemetry.c: see telemetry.h.
 *
 * The plant's world is x east, y north, theta counterclockwise from east; MAVLink's is north, east, and yaw clockwise
 * from north. */
#include "telemetry.h"
#include "board_ids.h"
#include "marconet_board.h"
#include "marconet_numbers.h"
#include "motion.h"

static const double PI = 3.141592653589793;
enum { MS_NS = 1000000, S_NS = 1000000000, SHORTEST_NS = 5 * MS_NS };

static struct {
    uint32_t message;
    int64_t start_interval_ns;          /* 0: off */
    int64_t interval_ns;
    int64_t next_ns;
} streams[STREAMS] = {
    { .message = MAVLINK_MSG_ID_HEARTBEAT, .start_interval_ns = S_NS },
    { .message = MAVLINK_MSG_ID_SYSTEM_TIME, .start_interval_ns = S_NS },
    { .message = MAVLINK_MSG_ID_ATTITUDE },
    { .message = MAVLINK_MSG_ID_LOCAL_POSITION_NED },
};
enum { ATTITUDE = 2, POSITION = 3 };

static double sense(uint32_t sensor)
{
    double value = 0.0;
    board_sense(sensor, &value);
    return value;
}

static uint32_t boot_ms(void) { return (uint32_t)floor_div(board_now(), MS_NS); }

/* Return the angle in [-pi, pi). */
static double wrapped(double angle_rad)
{
    const double turns = (angle_rad + PI) / (2.0 * PI);
    const int64_t below = (int64_t)turns - (turns < (double)(int64_t)turns ? 1 : 0);
    return angle_rad - 2.0 * PI * (double)below;
}

/* --- the messages */

static void heartbeat(mavlink_message_t *message)
{
    const bool armed = motion_armed();
    const mavlink_heartbeat_t told = {
        .type = MAV_TYPE_GROUND_ROVER, .autopilot = MAV_AUTOPILOT_GENERIC, .mavlink_version = 3,
        .base_mode = MAV_MODE_FLAG_MANUAL_INPUT_ENABLED | (armed ? MAV_MODE_FLAG_SAFETY_ARMED : 0),
        .system_status = armed ? MAV_STATE_ACTIVE : MAV_STATE_STANDBY };
    mavlink_msg_heartbeat_encode(mavlink_system.sysid, mavlink_system.compid, message, &told);
}

static void system_time(mavlink_message_t *message)
{
    const mavlink_system_time_t told = { .time_unix_usec = 0, .time_boot_ms = boot_ms() };     /* the date is unknown */
    mavlink_msg_system_time_encode(mavlink_system.sysid, mavlink_system.compid, message, &told);
}

static void attitude(mavlink_message_t *message)
{
    const mavlink_attitude_t told = { .time_boot_ms = boot_ms(),
                                      .yaw = (float)wrapped(PI / 2.0 - sense(SENSOR_THETA)),
                                      .yawspeed = (float)-sense(SENSOR_OMEGA) };
    mavlink_msg_attitude_encode(mavlink_system.sysid, mavlink_system.compid, message, &told);
}

/* The velocity is the mean since the message before; the rover has no sensor of it in this frame. */
static void position(mavlink_message_t *message)
{
    static double before_north_m, before_east_m;
    static int64_t before_ns;
    static bool has_before;
    const double north_m = sense(SENSOR_Y), east_m = sense(SENSOR_X);
    mavlink_local_position_ned_t told = { .time_boot_ms = boot_ms(), .x = (float)north_m, .y = (float)east_m };
    if (has_before && board_now() > before_ns) {
        const double elapsed_s = (double)(board_now() - before_ns) / 1e9;
        told.vx = (float)((north_m - before_north_m) / elapsed_s);
        told.vy = (float)((east_m - before_east_m) / elapsed_s);
    }
    before_north_m = north_m;
    before_east_m = east_m;
    before_ns = board_now();
    has_before = true;
    mavlink_msg_local_position_ned_encode(mavlink_system.sysid, mavlink_system.compid, message, &told);
}

bool telemetry_send(uint32_t number)
{
    mavlink_message_t message;
    switch (number) {
    case MAVLINK_MSG_ID_HEARTBEAT: heartbeat(&message); break;
    case MAVLINK_MSG_ID_SYSTEM_TIME: system_time(&message); break;
    case MAVLINK_MSG_ID_ATTITUDE: attitude(&message); break;
    case MAVLINK_MSG_ID_LOCAL_POSITION_NED: position(&message); break;
    default: return false;
    }
    link_send(&message);
    return true;
}

/* --- their times */

static void begin(uint32_t stream, int64_t interval_ns)
{
    streams[stream].interval_ns = interval_ns;
    if (interval_ns == 0) {
        board_cancel_timer(stream);
        return;
    }
    streams[stream].next_ns = board_now() + interval_ns;
    board_set_timer(stream, streams[stream].next_ns, 0);
}

static int64_t interval_of(uint32_t parameter)
{
    double rate_hz = 0.0;
    board_parameter(parameter, 0, &rate_hz);
    return rate_hz > 0.0 ? larger(SHORTEST_NS, rounded(1e9 / rate_hz)) : 0;
}

void telemetry_start(void)
{
    streams[ATTITUDE].start_interval_ns = interval_of(PARAMETER_ATTITUDE_HZ);
    streams[POSITION].start_interval_ns = interval_of(PARAMETER_POSITION_HZ);
    for (uint32_t i = 0; i < STREAMS; i++) {
        begin(i, streams[i].start_interval_ns);
    }
}

void telemetry_due(uint32_t stream)
{
    telemetry_send(streams[stream].message);
    const int64_t late_ns = board_now() - streams[stream].next_ns;     /* more than 0 after a step of the clock */
    streams[stream].next_ns += (floor_div(late_ns, streams[stream].interval_ns) + 1) * streams[stream].interval_ns;
    board_set_timer(stream, streams[stream].next_ns, 0);
}

uint8_t telemetry_set_interval(float message, float interval_us)
{
    uint32_t stream = 0;
    while (stream < STREAMS && message != (float)streams[stream].message) {
        stream++;
    }
    if (stream == STREAMS) {
        return MAV_RESULT_UNSUPPORTED;
    }
    if (!(-1.0f <= interval_us && interval_us <= 2147483520.0f)) {      /* false for a value that is no number */
        return MAV_RESULT_DENIED;
    }
    const int64_t interval_ns = (int64_t)((double)interval_us * 1e3);
    begin(stream, interval_us == 0.0f ? streams[stream].start_interval_ns
          : interval_us < 0.0f ? 0 : larger(SHORTEST_NS, interval_ns));
    return MAV_RESULT_ACCEPTED;
}
