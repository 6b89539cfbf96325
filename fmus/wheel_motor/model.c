/* Brushed DC motor, winding inductance neglected (L/R << J R / k^2).
 *
 *     i = (u - k omega) / R          J d(omega)/dt = k i
 *
 * Stepped with the exact solution for constant u, so it is stable at any step size. */
#include <math.h>

#include "variables.h"

void model_step(Values *v, double h /* [s] */)
{
    const double no_load = v->u / v->k;                 /* [rad/s] */
    const double tau = v->J * v->R / (v->k * v->k);     /* [s] */
    v->omega = no_load + (v->omega - no_load) * exp(-h / tau);
}
