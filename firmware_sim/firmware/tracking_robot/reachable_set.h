/* reachable_set.h: the reachable set of the tracking error until the next measurement: C_i of section 4.5, steps 5 and 6,
 * as agents/tracking/reachable_set.py.
 *
 *     c(t) = Rot(-omega1 t) (x1, x2) - v1 (sin(omega1 t), cos(omega1 t) - 1) / omega1
 *
 * is the path, in R1's frame, of a point at rest while R1 drives the held command (v1, omega1). The error starts within
 * `noise` of the measurement in each component, and R2 drives any inputs within `limits`. */
#ifndef REACHABLE_SET_H
#define REACHABLE_SET_H

#include "controller.h"

typedef struct {
    double m1, m2, m3;          /* M_k >= |x_k(t)| [m, m, rad] */
} Extents;

typedef struct {
    TrackingError x;            /* measured */
    Velocities command, limits;
    double noise;               /* [m, m, rad] */
} Start;

/* Return M1, M2, M3 over [0, tau] [s]; they do not decrease with tau. */
Extents extents_until(const Start *start, double tau);

#endif
