/* Quadrotor: rigid body under four rotors, drag and gravity, above a ground on which it can stand.
 *
 *     tau dw_i/dt = u_i - w_i       T_i = k_thrust w_i^2       M_i = k_moment w_i^2        front, left, back, right
 *     dp/dt = v                     m dv/dt = R(q) ((0, 0, sum T_i) - drag R(q)' (v - wind)) - (0, 0, m g)
 *     dq/dt = q * (0, omega) / 2    J domega/dt = tau - omega x J omega
 *     tau = (arm (T_left - T_right), arm (T_back - T_front), M_front - M_left + M_back - M_right)
 *
 * Motor speeds are closed forms. Flight: Runge-Kutta of fourth order in equal parts of at most h_max and tau.
 *
 *     FLIES (z > 0 or v_z > 0)  --z reaches 0; instant by regula falsi-->             STANDS: v = omega = 0, level
 *     STANDS                    --lift exceeds the weight; instant in closed form-->  FLIES
 *
 * Sources: Michael, Mellinger, Lindsey, Kumar 2010, The GRASP multiple micro-UAV testbed (equations, rotor order by
 * axes); Faessler, Franchi, Scaramuzza 2018 (drag of rotors near hover, linear in speed).
 * Not modelled: rotor inertia and its gyroscopic moment, ground effect, flapping, bouncing, toppling, a battery. */
#include "variables.h"

#include <math.h>

#define MOST_PARTS 1e8   /* a step that needs more fails: its parameters are unreasonable */
#define MOST_LANDINGS 64 /* per step; a step with more fails. Each motor's thrust has at most one extreme in a step */

enum { PX, PY, PZ, VX, VY, VZ, QW, QX, QY, QZ, OX, OY, OZ, STATES };

/* Motor speed at time t of a step is goal + gap * exp(-t / tau). */
typedef struct {
    double goal[4], gap[4]; /* [rad/s] */
} Motors;

static Motors motors_of(const Values *v)
{
    Motors m;
    for (int i = 0; i < 4; i++) {
        m.goal[i] = v->u[i] > 0 ? fmin(fmax(v->u[i], v->motor_min), v->motor_max) : 0;
        m.gap[i] = v->motor[i] - m.goal[i];
    }
    return m;
}

/* out = total thrust [N] and three torques [N.m] at the time t with exp(-t / tau) = decay. */
static void rotors(const Values *v, const Motors *m, double decay, double out[4])
{
    double square[4];
    for (int i = 0; i < 4; i++) {
        const double w = m->goal[i] + m->gap[i] * decay;
        square[i] = w * w;
    }
    out[0] = v->k_thrust * (square[0] + square[1] + square[2] + square[3]);
    out[1] = v->arm * v->k_thrust * (square[1] - square[3]);
    out[2] = v->arm * v->k_thrust * (square[2] - square[0]);
    out[3] = v->k_moment * (square[0] - square[1] + square[2] - square[3]);
}

/* R = rotation matrix of q, row by row. */
static void rotation(const double q[4], double R[9])
{
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    R[0] = 1 - 2 * (y * y + z * z), R[1] = 2 * (x * y - w * z), R[2] = 2 * (x * z + w * y);
    R[3] = 2 * (x * y + w * z), R[4] = 1 - 2 * (x * x + z * z), R[5] = 2 * (y * z - w * x);
    R[6] = 2 * (x * z - w * y), R[7] = 2 * (y * z + w * x), R[8] = 1 - 2 * (x * x + y * y);
}

/* out = specific force [m/s2] in the body's axes. */
static void specific_force(const Values *v, const double R[9], const double velocity[3], double thrust, double out[3])
{
    const double a[3] = {velocity[0] - v->wind[0], velocity[1] - v->wind[1], velocity[2] - v->wind[2]};
    for (int i = 0; i < 3; i++)
        out[i] = ((i == 2 ? thrust : 0) - v->drag[i] * (R[i] * a[0] + R[3 + i] * a[1] + R[6 + i] * a[2])) / v->mass;
}

static void slope(const Values *v, const double s[STATES], const double force[4], double out[STATES])
{
    const double *J = v->J, *q = s + QW, *o = s + OX;
    double R[9], f[3];
    rotation(q, R);
    specific_force(v, R, s + VX, force[0], f);
    for (int i = 0; i < 3; i++) {
        out[PX + i] = s[VX + i];
        out[VX + i] = R[3 * i] * f[0] + R[3 * i + 1] * f[1] + R[3 * i + 2] * f[2];
    }
    out[VZ] -= v->g;
    out[QW] = 0.5 * (-q[1] * o[0] - q[2] * o[1] - q[3] * o[2]);
    out[QX] = 0.5 * (q[0] * o[0] + q[2] * o[2] - q[3] * o[1]);
    out[QY] = 0.5 * (q[0] * o[1] + q[3] * o[0] - q[1] * o[2]);
    out[QZ] = 0.5 * (q[0] * o[2] + q[1] * o[1] - q[2] * o[0]);
    out[OX] = (force[1] - (J[2] - J[1]) * o[1] * o[2]) / J[0];
    out[OY] = (force[2] - (J[0] - J[2]) * o[2] * o[0]) / J[1];
    out[OZ] = (force[3] - (J[1] - J[0]) * o[0] * o[1]) / J[2];
}

/* to = state after h from `from`; `decay` holds exp(-t / tau) at the start, the middle and the end of this part. */
static void runge_kutta(const Values *v, const Motors *m, const double decay[3], const double from[STATES], double h,
                        double to[STATES])
{
    double force[3][4], k[4][STATES], at[STATES];
    for (int i = 0; i < 3; i++)
        rotors(v, m, decay[i], force[i]);
    slope(v, from, force[0], k[0]);
    for (int stage = 1; stage < 4; stage++) {
        const double part = stage < 3 ? 0.5 * h : h;
        for (int i = 0; i < STATES; i++)
            at[i] = from[i] + part * k[stage - 1][i];
        slope(v, at, force[(stage + 1) / 2], k[stage]);
    }
    for (int i = 0; i < STATES; i++)
        to[i] = from[i] + h / 6 * (k[0][i] + 2 * (k[1][i] + k[2][i]) + k[3][i]);
    const double length = sqrt(to[QW] * to[QW] + to[QX] * to[QX] + to[QY] * to[QY] + to[QZ] * to[QZ]);
    for (int i = QW; i <= QZ; i++)
        to[i] /= length;
}

static void part(const Values *v, const Motors *m, double t, const double from[STATES], double h, double to[STATES])
{
    const double start = exp(-t / v->tau_motor), half = exp(-0.5 * h / v->tau_motor);
    const double decay[3] = {start, start * half, start * half * half};
    runge_kutta(v, m, decay, from, h, to);
}

/* Return the length <= h after which z is 0, by the Illinois rule; z >= 0 at the start and z_after < 0 after h. */
static double touch(const Values *v, const Motors *m, double t, const double from[STATES], double h, double z_after)
{
    double low = 0, high = h, z_low = from[PZ], z_high = z_after, to[STATES];
    for (int k = 0; k < 100 && z_low > 0 && high - low > 1e-15 * (t + h); k++) {
        const double middle = low + (high - low) * z_low / (z_low - z_high);
        part(v, m, t, from, middle, to);
        if (to[PZ] < 0) {
            high = middle, z_high = to[PZ], z_low /= 2;
        } else {
            low = middle, z_low = to[PZ], z_high /= 2;
        }
    }
    return high;
}

/* Integrate the flight from t until the ground is touched, at most until `end`; return that time. */
static double fly(const Values *v, const Motors *m, double t, double end, double s[STATES])
{
    const double parts = fmax(1, ceil((end - t) / fmin(v->h_max, v->tau_motor) * (1 - 1e-12)));
    const double h = (end - t) / parts, half = exp(-0.5 * h / v->tau_motor);
    if (!(parts <= MOST_PARTS)) {
        s[PZ] = NAN; /* instance.c reports the step as failed */
        return end;
    }
    double to[STATES];
    for (double k = 0; k < parts; k++) {
        const double at = t + k * h, start = exp(-at / v->tau_motor);
        const double decay[3] = {start, start * half, start * half * half};
        runge_kutta(v, m, decay, s, h, to);
        if (to[PZ] < 0) {
            const double length = touch(v, m, at, s, h, to[PZ]);
            part(v, m, at, s, length, to);
            for (int i = 0; i < STATES; i++)
                s[i] = to[i];
            s[PZ] = 0;
            return at + length;
        }
        for (int i = 0; i < STATES; i++)
            s[i] = to[i];
    }
    return end;
}

static void stand_still(double s[STATES])
{
    const double turn = atan2(2 * (s[QW] * s[QZ] + s[QX] * s[QY]), 1 - 2 * (s[QY] * s[QY] + s[QZ] * s[QZ]));
    s[PZ] = 0;
    for (int i = 0; i < 3; i++)
        s[VX + i] = s[OX + i] = 0;
    s[QW] = cos(turn / 2), s[QX] = 0, s[QY] = 0, s[QZ] = sin(turn / 2);
}

/* Return the first time from t on at which a standing quadrotor lifts off, `end` if it does not before. Lift minus
 * weight, divided by k_thrust, is c d^2 + b d + a with d = exp(-t / tau) falling to 0. It is positive below the smaller
 * root if b < 0 < a. */
static double lift_off(const Values *v, const Motors *m, double t, double end)
{
    double a = (v->drag[2] * v->wind[2] - v->mass * v->g) / v->k_thrust, b = 0, c = 0;
    for (int i = 0; i < 4; i++) {
        a += m->goal[i] * m->goal[i];
        b += 2 * m->goal[i] * m->gap[i];
        c += m->gap[i] * m->gap[i];
    }
    const double now = exp(-t / v->tau_motor);
    if ((c * now + b) * now + a > 0)
        return t;
    if (!(b < 0 && a > 0))
        return end;
    const double root = 2 * a / (-b + sqrt(fmax(0, b * b - 4 * a * c)));
    return root < now ? fmin(end, -v->tau_motor * log(root)) : t;
}

void model_step(Values *v, double h /* [s] */)
{
    const Motors m = motors_of(v);
    double s[STATES] = {v->x, v->y, v->z, v->v[0], v->v[1], v->v[2], v->q[0], v->q[1], v->q[2], v->q[3],
                        v->omega[0], v->omega[1], v->omega[2]};
    double t = 0;
    for (int landings = 0; t < h; landings++) {
        if (landings == MOST_LANDINGS) {
            s[PZ] = NAN;
            break;
        }
        if (s[PZ] <= 0 && s[VZ] <= 0) {
            stand_still(s);
            t = lift_off(v, &m, t, h);
        }
        if (t < h)
            t = fly(v, &m, t, h, s);
    }
    if (s[PZ] <= 0 && s[VZ] <= 0) /* the ground was touched at the end of the step */
        stand_still(s);
    const double decay = exp(-h / v->tau_motor);
    v->x = s[PX], v->y = s[PY], v->z = s[PZ];
    for (int i = 0; i < 3; i++) {
        v->v[i] = s[VX + i];
        v->omega[i] = s[OX + i];
    }
    for (int i = 0; i < 4; i++) {
        v->q[i] = s[QW + i];
        v->motor[i] = m.goal[i] + m.gap[i] * decay;
    }
}

void model_outputs(Values *v)
{
    const double *q = v->q;
    double R[9], squares = 0;
    for (int i = 0; i < 4; i++)
        squares += v->motor[i] * v->motor[i];
    v->thrust = v->k_thrust * squares;
    v->on_ground = v->z <= 0 && v->v[2] <= 0 && v->thrust + v->drag[2] * v->wind[2] <= v->mass * v->g;
    rotation(q, R);
    v->heading = atan2(R[3], R[0]);
    v->roll = atan2(R[7], R[8]);
    v->pitch = asin(fmax(-1, fmin(1, -R[6])));
    specific_force(v, R, v->v, v->thrust, v->force);
    if (v->on_ground) { /* the ground supports it: the specific force at rest */
        v->force[0] = v->force[1] = 0;
        v->force[2] = v->g;
    }
}
