/* Differential drive: two wheels with first-order speed, limits and slip carry a body over the plane.
 *
 *     dx/dt     = v cos(theta) + icr_x omega sin(theta)      v     = (g_right + g_left) / 2
 *     dy/dt     = v sin(theta) - icr_x omega cos(theta)      omega = (g_right - g_left) / track
 *     dtheta/dt = omega                                      g     = r (1 - slip) wheel speed, the wheel's ground speed
 *
 * Wheel speeds, angles and theta are closed forms in time (wheel.h). For constant wheel speeds so are x and y:
 *
 *     chord = v h sin(a) / a in direction theta + a,  a = omega h / 2
 *
 * While wheel speeds change, x and y are 8-point Gauss sums over parts with omega h <= 1/2 and h <= tau / 2. The error
 * of a Gauss sum of m points is at most (64/15) M rho^-2m / (1 - rho^-2) h / 2, with M the largest |v cos theta| within
 * the Bernstein ellipse rho (Trefethen 2013, Approximation Theory and Approximation Practice, theorem 19.3). For
 * rho = 12, speeds in the ellipse are at most 3.6 times their bound on the part and |Im theta| <= 5.4. So the error is
 * at most 5e-15 of the largest distance that the wheels can cover in the part.
 *
 * Source of the kinematics with slip: Martinez et al. 2005, Approximating kinematics for tracked mobile robots,
 * Int. J. Robotics Research 24(10): constant centres of rotation, here as track, slip and icr_x.
 * Not modelled: mass, forces, slip that depends on speed or curvature, an uneven ground. */
#include "variables.h"
#include "wheel.h"

#define MOST_PARTS 1e6 /* a step that needs more fails: its parameters are unreasonable */

static const double NODE[4] = {0.18343464249564980, 0.52553240991632899, 0.79666647741362674, 0.96028985649753623};
static const double WEIGHT[4] = {0.36268378337836198, 0.31370664587788729, 0.22238103445337447, 0.10122853629037626};

typedef struct {
    Wheel left, right;
    double roll_left, roll_right; /* [m] of ground per rad of wheel */
    double track;                 /* [m] */
    double theta;                 /* [rad] at the start of the step */
} Motion;

static Wheel wheel_of(const Values *v, double speed, double u, double gain, double side)
{
    const double r = v->wheel_radius_m;
    const double command = gain * (u + (v->v_cmd + side * v->omega_cmd * v->track_m / 2) / r);
    return wheel_at(speed, command, v->speed_max_mps / r, v->accel_max_mps2 / r, v->tau_wheel_s);
}

static Motion motion_of(const Values *v)
{
    const Motion m = {
        wheel_of(v, v->wheel_left, v->u_left, v->gain_left, -1),
        wheel_of(v, v->wheel_right, v->u_right, v->gain_right, 1),
        v->wheel_radius_m * (1 - v->slip_left),
        v->wheel_radius_m * (1 - v->slip_right),
        v->track_m,
        v->theta,
    };
    return m;
}

static double forward_speed(const Motion *m, double t)
{
    return (m->roll_right * wheel_speed(&m->right, t) + m->roll_left * wheel_speed(&m->left, t)) / 2;
}

static double turn_rate(const Motion *m, double t)
{
    return (m->roll_right * wheel_speed(&m->right, t) - m->roll_left * wheel_speed(&m->left, t)) / m->track;
}

static double heading(const Motion *m, double t)
{
    return m->theta
         + (m->roll_right * wheel_angle(&m->right, t) - m->roll_left * wheel_angle(&m->left, t)) / m->track;
}

/* Advance x and y over [t, end), in which wheel speeds are constant: exactly an arc. */
static void arc(Values *v, const Motion *m, double t, double end)
{
    const double a = turn_rate(m, t) * (end - t) / 2;
    const double chord = forward_speed(m, t) * (end - t) * (a != 0 ? sin(a) / a : 1);
    const double direction = heading(m, t) + a;
    v->x += chord * cos(direction);
    v->y += chord * sin(direction);
}

/* Advance x and y over [t, end), in which each wheel stays in one phase, by Gauss sums. */
static void gauss(Values *v, const Motion *m, double t, double end)
{
    const double length = end - t;
    const double decay = wheel_decays(&m->left, t) || wheel_decays(&m->right, t) ? length / m->left.tau : 0;
    const double turn = (fabs(m->roll_right) * wheel_bound(&m->right, t, length)
                       + fabs(m->roll_left) * wheel_bound(&m->left, t, length)) / m->track * length;
    const double parts = fmax(1, ceil(2 * fmax(turn, decay)));
    if (!(parts <= MOST_PARTS)) {
        v->x = NAN; /* instance.c reports the step as failed */
        return;
    }
    double dx = 0, dy = 0;
    for (double k = 0; k < parts; k++)
        for (int i = 0; i < 8; i++) {
            const double at = t + length * (k + 0.5 + (i < 4 ? -0.5 : 0.5) * NODE[i % 4]) / parts;
            const double way = WEIGHT[i % 4] * forward_speed(m, at), direction = heading(m, at);
            dx += way * cos(direction);
            dy += way * sin(direction);
        }
    v->x += dx * length / parts / 2;
    v->y += dy * length / parts / 2;
}

/* Return the end of the wheel's phase at `t`, at most `end`. */
static double phase_end(const Wheel *w, double t, double end)
{
    if (t < w->ramp_end)
        return fmin(end, w->ramp_end);
    return t < w->settled ? fmin(end, w->settled) : end;
}

void model_step(Values *v, double h /* [s] */)
{
    const Motion m = motion_of(v);
    for (double t = 0; t < h;) {
        const double end = phase_end(&m.left, t, phase_end(&m.right, t, h));
        if (t >= m.left.settled && t >= m.right.settled)
            arc(v, &m, t, end);
        else
            gauss(v, &m, t, end);
        t = end;
    }
    v->theta = heading(&m, h);
    const double half = (v->theta - m.theta) / 2; /* the body turns about a point icr_x ahead of (x, y) */
    const double across = 2 * v->icr_x_m * sin(half);
    v->x += across * sin(m.theta + half);
    v->y -= across * cos(m.theta + half);
    v->angle_left += wheel_angle(&m.left, h);
    v->angle_right += wheel_angle(&m.right, h);
    v->wheel_left = wheel_speed(&m.left, h);
    v->wheel_right = wheel_speed(&m.right, h);
}

void model_outputs(Values *v)
{
    const Motion m = motion_of(v);
    v->wheel_left = m.left.start; /* without lag the command itself */
    v->wheel_right = m.right.start;
    v->v = forward_speed(&m, 0);
    v->omega = turn_rate(&m, 0);
}
