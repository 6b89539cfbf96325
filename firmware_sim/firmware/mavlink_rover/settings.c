/* settings.c: see settings.h. */
#include "settings.h"
#include "board_ids.h"
#include "marconet_board.h"

enum { NAME_BYTES = MAVLINK_MSG_PARAM_VALUE_FIELD_PARAM_ID_LEN };

static const struct {
    char name[NAME_BYTES];
    uint32_t parameter;                 /* of board_ids.h: its value at the start */
    float min, max;
} known[SETTINGS] = {
    [SPEED_MAX] = { "SPEED_MAX", PARAMETER_SPEED_MAX_MPS, 0.0f, 100.0f },
    [TURN_MAX] = { "TURN_MAX", PARAMETER_TURN_MAX_RADPS, 0.0f, 100.0f },
    [CTRL_TIMEOUT] = { "CTRL_TIMEOUT", PARAMETER_CONTROL_TIMEOUT_S, 0.05f, 60.0f },
};

float setting[SETTINGS];

void settings_start(void)
{
    for (int i = 0; i < SETTINGS; i++) {
        double value = 0.0;
        board_parameter(known[i].parameter, 0, &value);
        setting[i] = (float)value;
    }
}

static void send(int i)
{
    mavlink_message_t message;
    mavlink_param_value_t value = { .param_value = setting[i], .param_count = SETTINGS, .param_index = (uint16_t)i,
                                    .param_type = MAV_PARAM_TYPE_REAL32 };
    for (int k = 0; k < NAME_BYTES; k++) {
        value.param_id[k] = known[i].name[k];
    }
    mavlink_msg_param_value_encode(mavlink_system.sysid, mavlink_system.compid, &message, &value);
    link_send(&message);
}

/* Return the number of the setting with this name, SETTINGS if there is none. A name of 16 bytes ends without a 0. */
static int find(const char *name)
{
    for (int i = 0; i < SETTINGS; i++) {
        int k = 0;
        while (k < NAME_BYTES && name[k] == known[i].name[k] && name[k] != '\0') {
            k++;
        }
        if (k == NAME_BYTES || name[k] == known[i].name[k]) {
            return i;
        }
    }
    return SETTINGS;
}

void settings_list(void)
{
    for (int i = 0; i < SETTINGS; i++) {
        send(i);
    }
}

void settings_read(const mavlink_message_t *message)
{
    mavlink_param_request_read_t asked;
    mavlink_msg_param_request_read_decode(message, &asked);
    const int i = asked.param_index >= 0 ? asked.param_index : find(asked.param_id);
    if (i < SETTINGS) {
        send(i);
    }
}

void settings_set(const mavlink_message_t *message)
{
    mavlink_param_set_t asked;
    mavlink_msg_param_set_decode(message, &asked);
    const int i = find(asked.param_id);
    if (i == SETTINGS) {
        return;
    }
    if (asked.param_type == MAV_PARAM_TYPE_REAL32 && known[i].min <= asked.param_value
        && asked.param_value <= known[i].max) {     /* false for a value that is no number */
        setting[i] = asked.param_value;
    }
    send(i);
}
