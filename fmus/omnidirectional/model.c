/* A robot on omnidirectional wheels: velocity and turn rate follow their commands with one lag.
 *
 *     tau dv/dt = c - v              c = (v_x_cmd, v_y_cmd), shortened to speed_max
 *     tau domega/dt = c_omega - omega        dx/dt = v_x   dy/dt = v_y   dtheta/dt = omega
 *
 * Commands are in the world frame, so that turning and moving are independent and every step is a closed form: with
 * e = exp(-h / tau)
 *
 *     v(h) = c + (v - c) e,      x(h) = x + c h + (v - c) tau (1 - e)
 *
 * Not modelled: wheels, slip, mass, forces, limits of acceleration. */
#include <math.h>
#include "variables.h"

typedef struct {
    double x, y, omega;
} Command;

static Command command_of(const Values *v)
{
    const double speed = hypot(v->v_x_cmd, v->v_y_cmd);
    const double share = v->speed_max_mps > 0 && speed > v->speed_max_mps ? v->speed_max_mps / speed : 1;
    const double most = v->omega_max_radps > 0 ? v->omega_max_radps : INFINITY;
    const Command c = {share * v->v_x_cmd, share * v->v_y_cmd, fmax(-most, fmin(most, v->omega_cmd))};
    return c;
}

static void follow(double *place, double *speed, double command, double tau, double h)
{
    const double lost = tau > 0 ? -expm1(-h / tau) : 1; /* share of the difference that has decayed after h */
    const double difference = *speed - command;
    *place += command * h + difference * tau * lost;
    *speed = tau > 0 ? command + difference * (1 - lost) : command;
}

void model_step(Values *v, double h /* [s] */)
{
    const Command c = command_of(v);
    follow(&v->x, &v->v_x, c.x, v->tau_s, h);
    follow(&v->y, &v->v_y, c.y, v->tau_s, h);
    follow(&v->theta, &v->omega, c.omega, v->tau_s, h);
}

void model_outputs(Values *v)
{
    if (v->tau_s > 0)
        return;
    const Command c = command_of(v);
    v->v_x = c.x;
    v->v_y = c.y;
    v->omega = c.omega;
}
