/* Virtual reference robot R2: a unicycle whose inputs are piecewise constant, given in advance.
 *
 *     dx/dt = (v + e_v) cos(theta)     dy/dt = (v + e_v) sin(theta)     dtheta/dt = omega + e_omega
 *
 * An arc starts where inputs or disturbance change. After a time s on it the pose is a closed form, with
 *
 *     chord = v s sin(a) / a in direction theta + a,  a = omega s / 2
 *
 * Time is counted in whole nanoseconds and a pose is computed from the start of its arc, never from the last step. So
 * inputs change exactly at their instants, and the host's choice of steps changes no bit of the result.
 *
 * Source: Tolic 2012, section 4.6 (omega_p = (v_R2, omega_R2), with e_omega superposed). */
#include <math.h>

#include "variables.h"

/* Return the index of the piece in force at `t_ns`, -1 before the first. */
static int piece_at(const Memory *memory, long long t_ns)
{
    int k = memory->count - 1;
    while (k >= 0 && memory->piece[k].from_ns > t_ns)
        k--;
    return k;
}

void model_start(Values *v)
{
    Memory *memory = &v->memory;
    memory->count = 0;
    for (int i = 0; i < PIECES; i++) {
        if (v->from_s[i] < 0)
            continue;
        const Piece piece = {llround(v->from_s[i] * 1e9), v->v_mps[i], v->omega_radps[i]};
        int k = memory->count++;
        for (; k > 0 && memory->piece[k - 1].from_ns > piece.from_ns; k--) /* stable: of equal from_s the last acts */
            memory->piece[k] = memory->piece[k - 1];
        memory->piece[k] = piece;
    }
    memory->now_ns = memory->arc_ns = 0;
    memory->rest_ns = 0;
    memory->arc_v = memory->arc_omega = 0;
    memory->arc_x = v->x;
    memory->arc_y = v->y;
    memory->arc_theta = v->theta;
}

/* Advance the pose from `now_ns` to `end_ns` with constant inputs. */
static void arc_to(Values *v, long long end_ns, double speed, double turn)
{
    Memory *memory = &v->memory;
    if (speed != memory->arc_v || turn != memory->arc_omega) {
        memory->arc_ns = memory->now_ns;
        memory->arc_x = v->x;
        memory->arc_y = v->y;
        memory->arc_theta = v->theta;
        memory->arc_v = speed;
        memory->arc_omega = turn;
    }
    const double s = (double)(end_ns - memory->arc_ns) / 1e9;
    const double a = turn * s / 2;
    const double chord = speed * s * (a != 0 ? sin(a) / a : 1);
    v->x = memory->arc_x + chord * cos(memory->arc_theta + a);
    v->y = memory->arc_y + chord * sin(memory->arc_theta + a);
    v->theta = memory->arc_theta + turn * s;
    memory->now_ns = end_ns;
}

void model_step(Values *v, double h /* [s] */)
{
    Memory *memory = &v->memory;
    const double wanted_ns = h * 1e9 + memory->rest_ns;
    const long long end_ns = memory->now_ns + llround(wanted_ns);
    memory->rest_ns = wanted_ns - (double)llround(wanted_ns);
    while (memory->now_ns < end_ns) {
        const int k = piece_at(memory, memory->now_ns);
        const long long next_ns = k + 1 < memory->count ? memory->piece[k + 1].from_ns : end_ns;
        arc_to(v, next_ns < end_ns ? next_ns : end_ns, (k < 0 ? 0 : memory->piece[k].v) + v->e_v,
               (k < 0 ? 0 : memory->piece[k].omega) + v->e_omega);
    }
}

void model_outputs(Values *v)
{
    const int k = piece_at(&v->memory, v->memory.now_ns);
    v->v = k < 0 ? 0 : v->memory.piece[k].v;
    v->omega = k < 0 ? 0 : v->memory.piece[k].omega;
}
