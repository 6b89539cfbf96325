/* Memory of an instance of virtual_reference besides its values: the pieces in order of time, the time in whole
 * nanoseconds, and the start of the present arc. */
#ifndef PIECES_H
#define PIECES_H

#define PIECES 16

typedef struct {
    long long from_ns; /* in force over [from_ns, from_ns of the next piece) */
    double v, omega;   /* [m/s] [rad/s] */
} Piece;

typedef struct {
    int count;
    Piece piece[PIECES];
    long long now_ns;
    double rest_ns;          /* fraction of a nanosecond by which the steps so far exceed now_ns */
    long long arc_ns;        /* start of the present arc */
    double arc_x, arc_y, arc_theta; /* [m] [m] [rad] pose at the start of the arc */
    double arc_v, arc_omega; /* [m/s] [rad/s] inputs on the arc, with the disturbance */
} Memory;

#endif
