/* motion.c: see motion.h. */
#include "motion.h"
#include "board_ids.h"
#include "marconet_board.h"
#include "settings.h"

enum { FULL = 1000 };                   /* a stick at its end */

static bool is_armed;

bool motion_armed(void) { return is_armed; }

static void drive(double speed_mps, double turn_radps)
{
    board_actuate(ACTUATOR_V_CMD, speed_mps);
    board_actuate(ACTUATOR_OMEGA_CMD, turn_radps);
}

void motion_arm(bool armed)
{
    if (armed != is_armed) {
        is_armed = armed;
        board_event(armed ? EVENT_ARMED : EVENT_DISARMED, "by COMPONENT_ARM_DISARM");
        drive(0.0, 0.0);
        board_cancel_timer(TIMER_MOTION);
    }
}

void motion_control(const mavlink_message_t *message)
{
    mavlink_manual_control_t stick;
    mavlink_msg_manual_control_decode(message, &stick);
    if (stick.target != mavlink_system.sysid) {
        return;
    }
    if (!is_armed || stick.x < -FULL || stick.x > FULL || stick.r < -FULL || stick.r > FULL) {
        board_count(COUNTER_CONTROLS_REFUSED, 1);
        return;
    }
    drive((double)stick.x / FULL * (double)setting[SPEED_MAX], (double)stick.r / FULL * (double)setting[TURN_MAX]);
    board_set_timer(TIMER_MOTION, board_now() + (int64_t)((double)setting[CTRL_TIMEOUT] * 1e9), BOARD_SILENT);
}

void motion_timeout(void)
{
    drive(0.0, 0.0);
    board_event(EVENT_NO_MANUAL_CONTROL, "for CTRL_TIMEOUT: the rover stops");
}
