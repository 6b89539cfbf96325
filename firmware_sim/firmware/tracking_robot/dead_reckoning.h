/* dead_reckoning.h: the robot's pose from the angles that its wheels have turned, as agents/tracking/dead_reckoning.py.
 *
 *     d = r (dl + dr) / 2,   dtheta = r (dr - dl) / b                r wheel radius, b track
 *     (x, y) += d sinc(dtheta / 2) (cos, sin)(theta + dtheta / 2)    sinc(a) = sin(a) / a
 *
 * After the last reading the pose is extrapolated along the last arc.
 * Not modelled: slip, which encoders do not measure. */
#ifndef DEAD_RECKONING_H
#define DEAD_RECKONING_H

#include <stdbool.h>
#include <stdint.h>
#include "controller.h"

typedef struct {
    double radius, track;               /* [m] */
    Pose pose;                          /* at the last reading */
    bool has_reading;
    int64_t at_ns;
    double left, right;                 /* angles at the last reading [rad] */
    double left_speed, right_speed;     /* over the last interval [rad/ns] */
} DeadReckoning;

void dead_reckoning_init(DeadReckoning *place, double radius, double track, Pose start);

/* Take the wheels' angles [rad] at `at_ns`; the first reading is the start. Drops a reading not later than the last. */
void dead_reckoning_read(DeadReckoning *place, int64_t at_ns, double left, double right);

/* Return the pose at `at_ns`, also before the last reading. */
Pose dead_reckoning_at(const DeadReckoning *place, int64_t at_ns);

#endif
