/* Memory of an instance of linear_system besides its values: the dimensions in use, the discretizations of the last
 * KEPT step sizes, so that a step whose size repeats costs only matrix-vector products, and the noise of noise.h. */
#ifndef DISCRETIZATION_H
#define DISCRETIZATION_H

#define STATES 8
#define INPUTS 4
#define OUTPUTS 4
#define KEPT 8
#define LEVELS 20                   /* halvings of an interval of the noise, down to 1 ns */
#define INTERVAL_NS (1LL << LEVELS) /* 1.05 ms */
#define SPAN_NS (128 * INTERVAL_NS) /* 0.134 s, after which the noise is added to the states */

typedef struct {
    double Z[STATES][STATES]; /* exp(A h) - I */
    double G[STATES][INPUTS]; /* integral of exp(A s) ds over [0, h], times B */
} Discretization;

typedef struct { /* of the first half of a stretch of 2 h: its noise, given that of the whole, has */
    double F[STATES][STATES];      /* exp(A h) */
    double gain[STATES][STATES];   /* the mean gain noise_of_the_whole, */
    double spread[STATES][STATES]; /* lower triangle, the covariance spread spread' */
} Half;

typedef struct {
    int draws;                     /* normal numbers of one draw: 0 without noise */
    long long interval;            /* index of the present interval; in discrete time of the sample */
    double without[STATES];        /* states without the noise since the start of the span */
    double before[STATES];         /* noise from the start of the span to that of the interval */
    double whole[STATES];          /* noise of the whole interval */
    double F[STATES][STATES];      /* exp(A INTERVAL_NS) */
    double spread[STATES][STATES]; /* lower triangle; spread spread' = covariance of `whole` */
    Half of[LEVELS];               /* of stretches of INTERVAL_NS, half of it, ..., 2 ns */
} Noise;

typedef struct {
    int n, m, p;            /* states, inputs, outputs in use */
    int next;               /* slot for the next new step size */
    double h[KEPT];         /* [s] step size of each slot, 0 = free */
    Discretization of[KEPT];
    long long since_ns;     /* time since the last sample instant, or since the start of the span of the noise */
    double held[INPUTS];    /* discrete time: inputs at the last sample instant, valid while since_ns > 0 */
    Noise noise;
} Memory;

#endif
