/* settings.h: the parameters that a ground station reads and sets, MAVLink's parameter protocol; all are REAL32. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include "link.h"

typedef enum { SPEED_MAX, TURN_MAX, CTRL_TIMEOUT, SETTINGS } Setting;

extern float setting[SETTINGS];         /* [m/s], [rad/s], [s] */

/* Read the values with which the rover starts. */
void settings_start(void);

void settings_list(void);
void settings_read(const mavlink_message_t *message);   /* PARAM_REQUEST_READ */
void settings_set(const mavlink_message_t *message);    /* PARAM_SET; the answer has the value in force afterwards */

#endif
