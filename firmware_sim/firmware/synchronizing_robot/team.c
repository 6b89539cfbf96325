/* team.c: reads the team's parameters, see team.h. */
#include "team.h"
#include <string.h>
#include "board_ids.h"
#include "marconet_board.h"

double team_value(uint32_t parameter, uint32_t index)
{
    double value = 0.0;
    board_parameter(parameter, index, &value);
    return value;
}

int64_t team_whole(uint32_t parameter, uint32_t index) { return (int64_t)team_value(parameter, index); }

static uint32_t length_of(uint32_t parameter) { return (uint32_t)board_parameter_length(parameter); }

bool team_read(Team *team)
{
    team->number = (uint32_t)team_value(PARAMETER_NUMBER, 0);
    team->outputs = (uint32_t)team_value(PARAMETER_OUTPUTS, 0);
    team->inputs = (uint32_t)team_value(PARAMETER_INPUTS, 0);
    if (team->outputs < 1 || team->outputs > MAX_VALUES || team->inputs < 1 || team->inputs > MAX_VALUES) {
        return false;
    }
    team->robots = length_of(PARAMETER_BIAS) / team->outputs;
    if (team->robots < 1 || team->robots > MAX_ROBOTS || team->number >= team->robots) {
        return false;
    }
    team->designs = length_of(PARAMETER_DESIGN_SLOT_NS);
    team->requests = length_of(PARAMETER_REQUEST_FROM_NS);
    team->discovered = team_value(PARAMETER_DISCOVERED, 0) != 0.0;
    team->resynchronize = team_value(PARAMETER_RESYNCHRONIZE, 0) != 0.0;
    team->watches_age = team_value(PARAMETER_WATCHES_AGE, 0) != 0.0;
    team->repeat_ns = team_whole(PARAMETER_REPEAT_NS, 0);
    team->boot_slot_ns = team_whole(PARAMETER_BOOT_SLOT_NS, 0);
    team->guard_ns = team_whole(PARAMETER_GUARD_NS, 0);
    team->data_airtime_ns = team_whole(PARAMETER_DATA_AIRTIME_NS, 0);
    team->control_airtime_ns = team_whole(PARAMETER_CONTROL_AIRTIME_NS, 0);
    team->latency_ns = team_whole(PARAMETER_LATENCY_NS, 0);
    team->own_delay_ns = team_whole(PARAMETER_OWN_DELAY_NS, 0);
    team->slot_needs_ns = team_whole(PARAMETER_SLOT_NEEDS_NS, 0);
    team->max_successive_losses = team_whole(PARAMETER_MAX_SUCCESSIVE_LOSSES, 0);
    team->oldest_value_ns = team_whole(PARAMETER_OLDEST_VALUE_NS, 0);
    team->sync_gain = team_value(PARAMETER_SYNC_GAIN, 0);
    team->sync_contraction = team_value(PARAMETER_SYNC_CONTRACTION, 0);
    return true;
}

void team_design(const Team *team, uint32_t number, Design *design)
{
    for (uint32_t i = 0; i < team->robots; i++) {
        design->heard[i] = (Robots)team_value(PARAMETER_DESIGN_HEARD, number * team->robots + i);
        design->part[i] = (uint8_t)team_value(PARAMETER_DESIGN_PART, number * team->robots + i);
    }
    design->parts = team_whole(PARAMETER_DESIGN_PARTS, number);
    design->slot_ns = team_whole(PARAMETER_DESIGN_SLOT_NS, number);
    design->certified_ns = team_whole(PARAMETER_DESIGN_CERTIFIED_NS, number);
    design->assumed_ns = team_whole(PARAMETER_DESIGN_ASSUMED_NS, number);
}

bool team_find_design(const Team *team, const Robots *heard, Design *design)
{
    for (uint32_t number = 0; number < team->designs; number++) {
        team_design(team, number, design);
        if (team_same_links(team, heard, design->heard)) {
            return true;
        }
    }
    return false;
}

void team_boot_design(const Team *team, Design *design)
{
    memset(design, 0, sizeof *design);
    for (uint32_t i = 0; i < team->robots; i++) {
        design->part[i] = (uint8_t)i;
    }
    design->parts = team->robots;
    design->slot_ns = team->boot_slot_ns;
}

bool team_same_links(const Team *team, const Robots *heard, const Robots *others)
{
    for (uint32_t i = 0; i < team->robots; i++) {
        if (heard[i] != others[i]) {
            return false;
        }
    }
    return true;
}
