/* link.c: see link.h. */
#include "board_ids.h"
#include "link.h"
#include "marconet_board.h"
#include <mavlink_helpers.h>

mavlink_system_t mavlink_system;

void link_send(const mavlink_message_t *message)
{
    uint8_t bytes[MAVLINK_MAX_PACKET_LEN];
    board_send(PORT_SERIAL, bytes, mavlink_msg_to_send_buffer(bytes, message));
}

/* Return whether the message is to this rover or to all; a message without addressee is to all. */
static bool for_this_rover(const mavlink_message_t *message)
{
    const mavlink_msg_entry_t *entry = mavlink_get_msg_entry(message->msgid);
    uint8_t system = 0, component = 0;
    if (entry->flags & MAV_MSG_ENTRY_FLAG_HAVE_TARGET_SYSTEM) {
        system = _MAV_RETURN_uint8_t(message, entry->target_system_ofs);
    }
    if (entry->flags & MAV_MSG_ENTRY_FLAG_HAVE_TARGET_COMPONENT) {
        component = _MAV_RETURN_uint8_t(message, entry->target_component_ofs);
    }
    return (system == 0 || system == mavlink_system.sysid) && (component == 0 || component == mavlink_system.compid);
}

bool link_take(uint8_t byte, mavlink_message_t *message)
{
    mavlink_status_t status;
    const bool complete = mavlink_parse_char(MAVLINK_COMM_0, byte, message, &status) == MAVLINK_FRAMING_OK;
    if (status.packet_rx_drop_count > 0) {          /* errors since the byte before */
        board_count(COUNTER_PARSE_ERRORS, status.packet_rx_drop_count);
    }
    if (!complete) {
        return false;
    }
    const bool ours = for_this_rover(message);
    board_count(ours ? COUNTER_MESSAGES_TAKEN : COUNTER_MESSAGES_FOR_OTHERS, 1);
    return ours;
}
