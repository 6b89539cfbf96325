/* error_bound.h: the growth ||A|| of the error between measurements, as agents/tracking/error_bound.py and heading_slope.py.
 *
 *         [ k1   k2 v M2   a13   ]      |g| <= A |e| + y~ (4.25) for |x_k| <= M_k; the symmetric matrix
 *         [ 0    k2 v M1   k3 M1 ]      of (4.47) takes the larger of each two entries across the diagonal;
 *         [ 0    k2 v      k3    ]      v = |v^_R2|
 *
 *     a13 = max over 0 <= z <= M2 of  k3 z + v D(k2 z^2, M3)
 *
 * D is a table that Python's companion computes: rows by M3, rounded up, columns by chords in k2 z^2. */
#ifndef ERROR_BOUND_H
#define ERROR_BOUND_H

#include "controller.h"
#include "reachable_set.h"

void error_bound_init(const Gains *gains);

/* Return ||A|| [1/s] for an input of R2 `v` [m/s] and M1, M2, M3. */
double growth_per_s(double v, Extents extents);

#endif
