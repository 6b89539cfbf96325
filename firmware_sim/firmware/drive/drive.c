/* drive.c: motor controller of a differential drive, as firmware_sim/drive_controller/drive_controller.py.
 *
 *     release  --execution--> outputs, odometry      release + period
 *     |  encoders, setpoint   |  wheel commands      |
 *
 * The reference speeds are those of the setpoint while running, otherwise ramped down to zero; both wheels change in
 * proportion. A drive that hears no setpoint for `stale_after_ns` is stale at its next release.
 *
 *                        setpoint RUN                  none for stale_after
 *         STOPPED ---------------------> RUNNING -----------------------------> STALE
 *            ^       setpoint STOP          |  ^            setpoint RUN          |
 *            +------------------------------+  +----------------------------------+
 *            +--------------------------------- setpoint STOP --------------------+ */
#include "board_ids.h"
#include "marconet_board.h"
#include "marconet_numbers.h"
#include "messages.h"
#include "wheel.h"

enum { TIMER_RELEASE, TIMER_DONE, TIMER_PUBLISH };
static const uint32_t NO_AGE_MS = 0xFFFFFFFFu;

static int64_t period_ns, offset_ns, execution_ns, odometry_every, status_every, stale_after_ns;
static double stop_ramp_radps2, ramp_radps2;
static uint32_t unit;
static WheelSettings settings;
static Wheel left, right;

static Setpoint setpoint;
static bool has_setpoint;
static int64_t heard_ns;                /* local time of the last setpoint */
static DriveState state = STOPPED;
static uint8_t counter;                 /* of the setpoint that the loop used last */
static uint32_t refused, publications;

static double left_radps, right_radps;  /* reference speeds */
static double left_command, right_command;
static int64_t release_ns, publication_ns, sampled_ns;
static bool sampled;

static double number(uint32_t parameter)
{
    double value = 0.0;
    board_parameter(parameter, 0, &value);
    return value;
}

static double size(double value) { return value < 0.0 ? -value : value; }

static int64_t release_after(int64_t local_ns)
{
    return offset_ns + larger(0, floor_div(local_ns - offset_ns, period_ns) + 1) * period_ns;
}

/* --- a release */

static int64_t read_encoders(int64_t now_ns)
{
    const int64_t elapsed_ns = sampled ? larger(0, now_ns - sampled_ns) : 0;
    double left_rad = 0.0, right_rad = 0.0;
    board_sense(SENSOR_ANGLE_LEFT, &left_rad);
    board_sense(SENSOR_ANGLE_RIGHT, &right_rad);
    if (elapsed_ns > 0) {
        wheel_read(&left, &settings, left_rad, elapsed_ns);
        wheel_read(&right, &settings, right_rad, elapsed_ns);
    } else {
        wheel_restart(&left, &settings, left_rad);
        wheel_restart(&right, &settings, right_rad);
    }
    sampled_ns = now_ns;
    sampled = true;
    return elapsed_ns;
}

static void look(int64_t now_ns)
{
    const DriveState before = state;
    state = !has_setpoint || !setpoint.runs ? STOPPED : now_ns - heard_ns >= stale_after_ns ? STALE : RUNNING;
    if (state == before) {
        return;
    }
    board_record(SIGNAL_DRIVE_STATE, (double)state);
    if (state == STALE) {
        board_event(EVENT_SETPOINT_STALE, "the wheels stop");
    } else if (before == STALE) {
        board_event(EVENT_SETPOINT_RECOVERED, state == RUNNING ? "the drive is RUNNING" : "the drive is STOPPED");
    } else {
        board_event(state == RUNNING ? EVENT_DRIVE_RUNNING : EVENT_DRIVE_STOPPED, "");
    }
}

static void follow_ramp(int64_t elapsed_ns)
{
    const bool running = state == RUNNING && has_setpoint;
    double to_left = running ? setpoint.left_radps : 0.0;
    double to_right = running ? setpoint.right_radps : 0.0;
    const double ramp = running ? ramp_radps2 : stop_ramp_radps2;
    const double change_left = size(to_left - left_radps), change_right = size(to_right - right_radps);
    const double longest = change_left > change_right ? change_left : change_right;
    const double step = ramp * (double)elapsed_ns / 1e9;
    if (step < longest && !(running && ramp == 0.0)) {
        to_left = left_radps + (to_left - left_radps) * step / longest;
        to_right = right_radps + (to_right - right_radps) * step / longest;
    }
    left_radps = to_left;
    right_radps = to_right;
    board_record(SIGNAL_SETPOINT_LEFT, left_radps);
    board_record(SIGNAL_SETPOINT_RIGHT, right_radps);
}

static void control(void)
{
    const int64_t now_ns = board_now();
    const int64_t elapsed_ns = read_encoders(now_ns);
    look(now_ns);
    if (has_setpoint) {
        counter = setpoint.counter;
    }
    follow_ramp(elapsed_ns);
    if (state != RUNNING && left_radps == 0.0 && right_radps == 0.0) {      /* motors off: the loop must not creep */
        left.integral_radps = right.integral_radps = 0.0;
        left_command = right_command = 0.0;
        return;
    }
    left_command = wheel_command(&left, &settings, left_radps, elapsed_ns);
    right_command = wheel_command(&right, &settings, right_radps, elapsed_ns);
}

/* --- its outputs */

static void publish(void)
{
    uint8_t bytes[CAN_BYTES];
    message_speeds(bytes, unit, left.speed_radps, right.speed_radps, state, counter);
    board_send(PORT_CAN, bytes, sizeof bytes);
    message_odometry(bytes, unit, left.count, right.count);
    board_send(PORT_CAN, bytes, sizeof bytes);
    if (publications % status_every == 0) {
        const int64_t age_ms = larger(0, board_now() - heard_ns) / 1000000;
        message_status(bytes, unit, state, counter, (uint16_t)refused,
                       !has_setpoint ? NO_AGE_MS : age_ms < NO_AGE_MS ? (uint32_t)age_ms : NO_AGE_MS - 1);
        board_send(PORT_CAN, bytes, sizeof bytes);
    }
    publications++;
}

/* Arm the timers of the next release and of the next publication, until which the drive is silent. */
static void plan(void)
{
    const int64_t release = floor_div(release_ns - offset_ns, period_ns);
    publication_ns = release_ns + floor_mod(-release, odometry_every) * period_ns;
    board_set_timer(TIMER_RELEASE, release_ns, BOARD_SILENT);
    board_set_timer(TIMER_PUBLISH, publication_ns + execution_ns, 0);
}

static void done(void)
{
    board_actuate(ACTUATOR_U_LEFT, left_command);
    board_actuate(ACTUATOR_U_RIGHT, right_command);
    if (publication_ns == release_ns) {
        publish();
    }
    const int64_t before_ns = release_ns;
    release_ns = release_after(board_now());
    const int64_t missed = floor_div(release_ns - before_ns, period_ns) - 1;
    if (missed > 0) {
        board_count(COUNTER_RELEASES_MISSED, (uint32_t)missed);
    }
    plan();
}

static void release(void)
{
    control();
    if (board_now() >= release_ns + execution_ns) {
        done();
    } else if (publication_ns == release_ns) {
        board_set_timer(TIMER_PUBLISH, release_ns + execution_ns, 0);
    } else {
        board_set_timer(TIMER_DONE, release_ns + execution_ns, BOARD_SILENT);
    }
}

/* --- what the board calls */

int32_t board_start(void)
{
    period_ns = (int64_t)number(PARAMETER_PERIOD_NS);
    offset_ns = (int64_t)number(PARAMETER_OFFSET_NS);
    execution_ns = (int64_t)number(PARAMETER_EXECUTION_NS);
    odometry_every = (int64_t)number(PARAMETER_ODOMETRY_EVERY);
    status_every = (int64_t)number(PARAMETER_STATUS_EVERY);
    stale_after_ns = (int64_t)number(PARAMETER_STALE_AFTER_NS);
    stop_ramp_radps2 = number(PARAMETER_STOP_RAMP_RADPS2);
    ramp_radps2 = number(PARAMETER_RAMP_RADPS2);
    unit = (uint32_t)number(PARAMETER_UNIT);
    const double most = number(PARAMETER_COMMAND_MAX_RADPS);
    const WheelSettings read = { number(PARAMETER_KP), number(PARAMETER_KI), number(PARAMETER_FEEDFORWARD),
                                 most > 0.0 ? most : 1e300, number(PARAMETER_COUNTS_PER_TURN) };
    settings = read;
    if (period_ns < 1 || odometry_every < 1 || status_every < 1) {
        return 1;
    }
    release_ns = release_after(board_now() - 1);
    plan();
    return 0;
}

void board_timer(uint32_t timer)
{
    if (timer == TIMER_RELEASE) {
        release();
    } else {
        done();
    }
}

void board_receive(uint32_t port, const uint8_t *data, uint32_t length)
{
    Setpoint heard;
    (void)port;
    switch (message_read(data, length, unit, &heard)) {
    case UNREADABLE:
        board_count(COUNTER_UNREADABLE_FRAMES, 1);
        break;
    case REFUSED:
        refused++;
        board_count(COUNTER_SETPOINTS_REFUSED, 1);
        board_event(EVENT_SETPOINT_REFUSED, "DriveSetpoint: not 8 bytes, or a value out of its range");
        break;
    case SETPOINT:
        board_count(COUNTER_SETPOINTS_TAKEN, 1);
        setpoint = heard;
        has_setpoint = true;
        heard_ns = board_now();
        break;
    case OTHER:
        break;
    }
}
