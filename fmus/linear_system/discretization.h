/* Memory of an instance of linear_system besides its values: the dimensions in use, and the discretizations of the last
 * KEPT step sizes, so that a step whose size repeats costs only matrix-vector products. */
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
    int next;               /* slot for the next new step size */
    double h[KEPT];         /* [s] step size of each slot, 0 = free */
    Discretization of[KEPT];
    long long since_ns;     /* discrete time: time since the last sample instant */
    double held[INPUTS];    /* discrete time: inputs at the last sample instant, valid while since_ns > 0 */
} Memory;

#endif
