/* motion.h: the rover's drive by MANUAL_CONTROL, while it is armed and the messages keep coming.
 *
 *     DISARMED --arm--> ARMED, standing --MANUAL_CONTROL--> ARMED, driving --CTRL_TIMEOUT of silence--> ARMED, standing
 */
#ifndef MOTION_H
#define MOTION_H

#include "link.h"
#include "telemetry.h"

enum { TIMER_MOTION = STREAMS };       /* rings when MANUAL_CONTROL has been silent for too long */

bool motion_armed(void);
void motion_arm(bool armed);

/* Drive as MANUAL_CONTROL says: x ahead, r counterclockwise, in thousandths; other axes and buttons have no effect. */
void motion_control(const mavlink_message_t *message);

/* Stop, since TIMER_MOTION has rung. */
void motion_timeout(void);

#endif
