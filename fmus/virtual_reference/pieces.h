/* What an instance of virtual_reference keeps beside its values: the pieces in order of time, its time in integers, and
 * where the present arc began. */
#ifndef PIECES_H
#define PIECES_H

#define PIECES 16

typedef struct {
    long long from_ns; /* in force over [from, from of the next) */
    double v, omega;   /* [m/s] [rad/s] */
} Piece;

typedef struct {
    int count;
    Piece piece[PIECES];
    long long now_ns;
    double rest_ns;          /* of steps that are no whole nanoseconds */
    long long arc_ns;        /* when the present arc began */
    double arc_x, arc_y, arc_theta;
    double arc_v, arc_omega; /* [m/s] [rad/s] its inputs, with the disturbance */
} Memory;

#endif
