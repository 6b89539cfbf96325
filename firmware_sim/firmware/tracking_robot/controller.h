/* controller.h: tracking of a reference robot R2 by a unicycle R1, as agents/tracking/controller.py.
 *
 *     x = Rot(-theta_R1) (R2 - R1)                                   tracking error in the frame of R1, (4.2)
 *     v_R1     = v_R2 cos x3 + k1 x1                                                                  (4.4)
 *     omega_R1 = omega_R2 + k2 v_R2 (sin x3 / x3) x2 + k3 x3 */
#ifndef CONTROLLER_H
#define CONTROLLER_H

typedef struct {
    double x1, x2;              /* ahead, left [m] */
    double x3;                  /* heading [rad] */
} TrackingError;

typedef struct {
    double v;                   /* [m/s] */
    double omega;               /* [rad/s] */
} Velocities;                   /* omega_p, the inputs of R2; u, the command to R1 */

typedef struct {
    double x, y;                /* [m] */
    double theta;               /* [rad], not wrapped */
} Pose;

typedef struct {
    double k1, k2, k3;          /* [1/s], [1/m^2], [1/s] */
} Gains;

/* Return x of (4.2); the heading error is brought to [-pi, pi]. */
TrackingError tracking_error(Pose own, Pose reference);

/* Return u of (4.4). */
Velocities control(const Gains *gains, TrackingError x, Velocities inputs);

#endif
