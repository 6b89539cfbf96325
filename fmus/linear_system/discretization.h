/* What an instance of linear_system keeps beside its values: how far the matrices are filled, and the discretizations
 * of the last few step sizes, so that the repeating steps of a periodic schedule cost a matrix-vector product. */
#ifndef DISCRETIZATION_H
#define DISCRETIZATION_H

#define STATES 8
#define INPUTS 4
#define OUTPUTS 4
#define KEPT 8

typedef struct {
    double Z[STATES][STATES]; /* exp(A h) - I */
    double G[STATES][INPUTS]; /* integral of exp(A s) ds over [0, h], times B */
} Discretization;

typedef struct {
    int n, m, p;            /* states, inputs, outputs in use */
    int next;               /* slot that the next new step size takes */
    double h[KEPT];         /* [s], 0 = free */
    Discretization of[KEPT];
    long long since_ns;     /* discrete time: since the last sample instant */
    double held[INPUTS];    /* discrete time: the inputs at the last sample instant, once time has left it */
} Memory;

#endif
