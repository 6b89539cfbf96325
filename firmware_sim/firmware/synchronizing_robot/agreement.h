/* agreement.h: the control law with held outputs (6.11):
 *
 *     u_i = -K_i sum_{j in N_i} [(yh_i - yh_j) - (d_i - d_j)]         yh: the value last broadcast, held
 *
 * A robot leaves out the term of a neighbour until it has received a value from it. The term of a neighbour that is new
 * in N_i acts from its next slot on, or at once if its value was received since the last slot of the old topology.
 *
 * Order of operations, the same in every language: errors are summed over j ascending, each term as
 * (own - other) - offset; a row of K times the errors is summed from the first output on. */
#ifndef AGREEMENT_H
#define AGREEMENT_H

#include "team.h"

typedef struct {
    uint32_t number, outputs, inputs;
    Robots neighbours;
    Robots held;                                    /* robots with a value in `value` */
    double value[MAX_ROBOTS][MAX_VALUES];
    double offset[MAX_ROBOTS][MAX_VALUES];          /* d_i - d_j */
    double gain[MAX_VALUES][MAX_VALUES];            /* K_i */
} Agreement;

void agreement_init(Agreement *law, const Team *team);

/* Set N_i; drop the values held of new neighbours, unless they are in `fresh`. */
void agreement_listen_to(Agreement *law, Robots neighbours, Robots fresh);

void agreement_hold(Agreement *law, uint32_t robot, const double *outputs);

/* Compute u_i without disturbance; zero until the robot's own first broadcast. */
void agreement_control(const Agreement *law, double *control);

#endif
