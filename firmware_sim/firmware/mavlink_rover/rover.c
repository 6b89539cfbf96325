/* rover.c: telemetry and manual control of a differential drive by MAVLink on a serial port.
 *
 *     serial --bytes--> link --messages--> settings, commands, motion --> v_cmd, omega_cmd
 *     serial <--bytes-- link <--messages-- telemetry <-- x, y, theta, omega
 *
 * Source: mavlink.io, the microservices heartbeat, parameter, command, ping and time synchronization; common.xml. */
#include "board_ids.h"
#include "link.h"
#include "marconet_board.h"
#include "motion.h"
#include "settings.h"
#include "telemetry.h"

static void acknowledge(const mavlink_message_t *asked, uint16_t command, uint8_t result)
{
    mavlink_message_t message;
    const mavlink_command_ack_t told = { .command = command, .result = result, .target_system = asked->sysid,
                                         .target_component = asked->compid };
    mavlink_msg_command_ack_encode(mavlink_system.sysid, mavlink_system.compid, &message, &told);
    link_send(&message);
}

static uint8_t arm_disarm(float wanted)
{
    if (wanted != 0.0f && wanted != 1.0f) {
        return MAV_RESULT_DENIED;
    }
    motion_arm(wanted == 1.0f);
    return MAV_RESULT_ACCEPTED;
}

static uint8_t request_message(float number)
{
    return 0.0f <= number && number < 65536.0f && telemetry_send((uint32_t)number) ? MAV_RESULT_ACCEPTED
                                                                                   : MAV_RESULT_UNSUPPORTED;
}

static void carry_out(const mavlink_message_t *message)
{
    mavlink_command_long_t asked;
    mavlink_msg_command_long_decode(message, &asked);
    uint8_t result = MAV_RESULT_UNSUPPORTED;
    switch (asked.command) {
    case MAV_CMD_COMPONENT_ARM_DISARM: result = arm_disarm(asked.param1); break;
    case MAV_CMD_SET_MESSAGE_INTERVAL: result = telemetry_set_interval(asked.param1, asked.param2); break;
    case MAV_CMD_REQUEST_MESSAGE: result = request_message(asked.param1); break;
    default: break;
    }
    acknowledge(message, asked.command, result);
}

static void ping(const mavlink_message_t *message)
{
    mavlink_ping_t told;
    mavlink_msg_ping_decode(message, &told);
    if (told.target_system != 0 || told.target_component != 0) {
        return;                         /* an answer to somebody's question */
    }
    told.target_system = message->sysid;
    told.target_component = message->compid;
    mavlink_message_t answer;
    mavlink_msg_ping_encode(mavlink_system.sysid, mavlink_system.compid, &answer, &told);
    link_send(&answer);
}

static void timesync(const mavlink_message_t *message)
{
    mavlink_timesync_t told;
    mavlink_msg_timesync_decode(message, &told);
    if (told.tc1 != 0) {
        return;                         /* an answer */
    }
    told.tc1 = board_now();
    mavlink_message_t answer;
    mavlink_msg_timesync_encode(mavlink_system.sysid, mavlink_system.compid, &answer, &told);
    link_send(&answer);
}

static void handle(const mavlink_message_t *message)
{
    switch (message->msgid) {
    case MAVLINK_MSG_ID_PARAM_REQUEST_LIST: settings_list(); break;
    case MAVLINK_MSG_ID_PARAM_REQUEST_READ: settings_read(message); break;
    case MAVLINK_MSG_ID_PARAM_SET: settings_set(message); break;
    case MAVLINK_MSG_ID_COMMAND_LONG: carry_out(message); break;
    case MAVLINK_MSG_ID_COMMAND_INT:
        acknowledge(message, mavlink_msg_command_int_get_command(message), MAV_RESULT_COMMAND_LONG_ONLY);
        break;
    case MAVLINK_MSG_ID_MANUAL_CONTROL: motion_control(message); break;
    case MAVLINK_MSG_ID_PING: ping(message); break;
    case MAVLINK_MSG_ID_TIMESYNC: timesync(message); break;
    default: break;                     /* of no interest to a rover */
    }
}

/* --- what the board calls */

static uint8_t number(uint32_t parameter)
{
    double value = 0.0;
    board_parameter(parameter, 0, &value);
    return (uint8_t)value;
}

int32_t board_start(void)
{
    mavlink_system.sysid = number(PARAMETER_SYSTEM);
    mavlink_system.compid = number(PARAMETER_COMPONENT);
    settings_start();
    telemetry_start();
    return 0;
}

void board_timer(uint32_t timer)
{
    if (timer == TIMER_MOTION) {
        motion_timeout();
    } else {
        telemetry_due(timer);
    }
}

void board_receive(uint32_t port, const uint8_t *data, uint32_t length)
{
    mavlink_message_t message;
    (void)port;
    for (uint32_t i = 0; i < length; i++) {
        if (link_take(data[i], &message)) {
            handle(&message);
        }
    }
}
