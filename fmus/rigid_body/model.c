/* Rigid body under thrust along its own z axis, three torques and gravity.
 *
 *     dp/dt = v                     m dv/dt = R(q) (0, 0, thrust) - (0, 0, m g)
 *     dq/dt = q * (0, omega) / 2    J domega/dt = torque - omega x J omega
 *
 * Stepped with the explicit midpoint rule, of second order in the step, which is at most h_max. The attitude turns at
 * the midpoint rate, so q keeps unit length.
 *
 * Not modelled: drag, rotor dynamics, ground, a full inertia tensor. */
#include <math.h>

#include "variables.h"

/* omega = v->omega after h, with the acceleration that the torque and the rates `at` cause */
static void turn_rates(const Values *v, const double at[3], double h, double omega[3])
{
    const double *J = v->J;
    omega[0] = v->omega[0] + h * (v->torque[0] - (J[2] - J[1]) * at[1] * at[2]) / J[0];
    omega[1] = v->omega[1] + h * (v->torque[1] - (J[0] - J[2]) * at[2] * at[0]) / J[1];
    omega[2] = v->omega[2] + h * (v->torque[2] - (J[1] - J[0]) * at[0] * at[1]) / J[2];
}

/* out = q after a rotation at the body rate omega over h */
static void turn(const double q[4], const double omega[3], double h, double out[4])
{
    const double rate = sqrt(omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2]);
    const double half = 0.5 * h * rate;
    const double c = cos(half), s = rate > 0 ? sin(half) / rate : 0.5 * h;
    const double x = s * omega[0], y = s * omega[1], z = s * omega[2];
    out[0] = c * q[0] - x * q[1] - y * q[2] - z * q[3];
    out[1] = c * q[1] + x * q[0] + z * q[2] - y * q[3];
    out[2] = c * q[2] + y * q[0] + x * q[3] - z * q[1];
    out[3] = c * q[3] + z * q[0] + y * q[1] - x * q[2];
}

static void part(Values *v, double h)
{
    double middle_rate[3], middle[4], omega[3], q[4];
    turn_rates(v, v->omega, 0.5 * h, middle_rate);
    turn(v->q, middle_rate, 0.5 * h, middle);
    turn(v->q, middle_rate, h, q);
    turn_rates(v, middle_rate, h, omega);

    const double *r = middle, lift = v->thrust / v->m; /* [m/s2] along the body's z axis at the middle of the step */
    const double a[3] = {
        lift * 2 * (r[1] * r[3] + r[0] * r[2]),
        lift * 2 * (r[2] * r[3] - r[0] * r[1]),
        lift * (r[0] * r[0] - r[1] * r[1] - r[2] * r[2] + r[3] * r[3]) - v->g,
    };
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]); /* 1 up to rounding */
    for (int i = 0; i < 3; i++) {
        v->p[i] += h * (v->v[i] + 0.5 * h * a[i]);
        v->v[i] += h * a[i];
        v->omega[i] = omega[i];
    }
    for (int i = 0; i < 4; i++)
        v->q[i] = q[i] / length;
}

void model_step(Values *v, double h /* [s] */)
{
    const double parts = fmax(1, ceil(h / v->h_max * (1 - 1e-12)));
    for (double k = 0; k < parts; k++)
        part(v, h / parts);
}
