/* agreement.c: (6.11), see agreement.h. */
#include "agreement.h"
#include "board_ids.h"

void agreement_init(Agreement *law, const Team *team)
{
    law->number = team->number;
    law->outputs = team->outputs;
    law->inputs = team->inputs;
    law->neighbours = law->held = 0;
    for (uint32_t j = 0; j < team->robots; j++) {
        for (uint32_t k = 0; k < law->outputs; k++) {
            law->offset[j][k] = team_value(PARAMETER_BIAS, law->number * law->outputs + k)
                                - team_value(PARAMETER_BIAS, j * law->outputs + k);
        }
    }
    for (uint32_t row = 0; row < law->inputs; row++) {
        for (uint32_t k = 0; k < law->outputs; k++) {
            law->gain[row][k] = team_value(PARAMETER_GAIN, row * law->outputs + k);
        }
    }
}

void agreement_listen_to(Agreement *law, Robots neighbours, Robots fresh)
{
    law->held = (Robots)(law->held & (law->neighbours | fresh | ONLY(law->number)));
    law->neighbours = neighbours;
}

void agreement_hold(Agreement *law, uint32_t robot, const double *outputs)
{
    for (uint32_t k = 0; k < law->outputs; k++) {
        law->value[robot][k] = outputs[k];
    }
    law->held = (Robots)(law->held | ONLY(robot));
}

void agreement_control(const Agreement *law, double *control)
{
    const uint32_t i = law->number;
    double errors[MAX_VALUES] = { 0.0 };
    if (!HAS(law->held, i)) {
        for (uint32_t row = 0; row < law->inputs; row++) {
            control[row] = 0.0;
        }
        return;
    }
    for (uint32_t j = 0; j < MAX_ROBOTS; j++) {
        if (HAS(law->neighbours & law->held, j)) {
            for (uint32_t k = 0; k < law->outputs; k++) {
                errors[k] += law->value[i][k] - law->value[j][k] - law->offset[j][k];
            }
        }
    }
    for (uint32_t row = 0; row < law->inputs; row++) {
        double product = law->gain[row][0] * errors[0];
        for (uint32_t k = 1; k < law->outputs; k++) {
            product += law->gain[row][k] * errors[k];
        }
        control[row] = -product;
    }
}
