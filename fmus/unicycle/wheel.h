/* Speed and angle of one wheel over a step: first at its acceleration limit, then exponential, then at constant speed.
 *
 *     tau d(speed)/dt = command - speed,  |d(speed)/dt| <= limit
 *
 *     0        ramp_end           settled
 *     | ramp   | gap exp(-s/tau)  | = goal                speed - goal at ramp_end is gap, |gap| <= tau * limit
 *
 * All phases are closed forms, so speed and angle are exact at any instant of the step. At `settled` the gap has
 * decayed to exp(-40) = 4e-18 of its value, which is below rounding. */
#ifndef WHEEL_H
#define WHEEL_H

#include <math.h>

#define SETTLING 40.0 /* time constants */

typedef struct {
    double start;    /* [rad/s] speed at the start of the step */
    double goal;     /* [rad/s] clipped command */
    double ramp;     /* [rad/s2] acceleration before ramp_end */
    double ramp_end; /* [s] after the start of the step */
    double gap;      /* [rad/s] speed - goal at ramp_end */
    double tau;      /* [s] */
    double settled;  /* [s] after the start of the step: from here on the speed is the goal */
} Wheel;

/* `top` [rad/s] limits the command, `limit` [rad/s2] the acceleration; 0 = no limit */
static Wheel wheel_at(double speed, double command, double top, double limit, double tau)
{
    const double goal = top > 0 ? fmin(fmax(command, -top), top) : command;
    const double gap = speed - goal;
    Wheel w = {speed, goal, 0, 0, gap, tau, 0};
    if (limit > 0 && fabs(gap) > limit * tau) {
        w.ramp = gap > 0 ? -limit : limit;
        w.gap = gap > 0 ? limit * tau : -limit * tau;
        w.ramp_end = (fabs(gap) - limit * tau) / limit;
    } else if (tau == 0) {
        w.start = goal; /* without lag or limit the wheel has the commanded speed at once */
        w.gap = 0;
    }
    w.settled = w.ramp_end + (w.gap != 0 ? SETTLING * tau : 0);
    return w;
}

static double wheel_speed(const Wheel *w, double t)
{
    if (t < w->ramp_end)
        return w->start + w->ramp * t;
    return w->gap != 0 ? w->goal + w->gap * exp(-(t - w->ramp_end) / w->tau) : w->goal;
}

/* [rad] turned from the start of the step */
static double wheel_angle(const Wheel *w, double t)
{
    const double ramp = fmin(t, w->ramp_end), rest = t - ramp;
    const double turned = ramp * (w->start + 0.5 * w->ramp * ramp) + w->goal * rest;
    return w->gap != 0 ? turned - w->gap * w->tau * expm1(-rest / w->tau) : turned;
}

static int wheel_decays(const Wheel *w, double t)
{
    return t >= w->ramp_end && t < w->settled;
}

/* Return an upper bound of |speed| over [t, t + length), which lies within one phase. */
static double wheel_bound(const Wheel *w, double t, double length)
{
    if (t < w->ramp_end)
        return fabs(w->start + w->ramp * t) + fabs(w->ramp) * length;
    return fabs(w->goal) + fabs(wheel_speed(w, t) - w->goal);
}

#endif
