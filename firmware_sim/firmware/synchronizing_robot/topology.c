/* topology.c: told topologies here, discovered ones in discovered.c; see topology.h.
 *
 * Told: a request holds from its instant on and is adopted at the next end of a round (section 6.3.1, Delta_u = 0). */
#include "topology.h"
#include <string.h>
#include "board_ids.h"
#include "discovered.h"
#include "marconet_numbers.h"

static uint32_t current;        /* design of the topology in force, told */

static uint32_t requested(const Team *team, int64_t local_ns)
{
    const int64_t since_ns = team->repeat_ns > 0 ? floor_mod(local_ns, team->repeat_ns) : local_ns;
    uint32_t request = 0;
    while (request + 1 < team->requests && team_whole(PARAMETER_REQUEST_FROM_NS, request + 1) <= since_ns) {
        request++;
    }
    return (uint32_t)team_value(PARAMETER_REQUEST_DESIGN, request);
}

void topology_init(const Team *team)
{
    current = requested(team, 0);
    if (team->discovered) {
        discovered_init(team);
    }
}

bool topology_heard_control(const Team *team, const Slots *slots, const uint8_t *bytes, uint32_t length,
                            int64_t sent_ns)
{
    return team->discovered && discovered_heard(team, slots, bytes, length, sent_ns);
}

void topology_before_own_slot(const Team *team, const Slots *slots, int64_t slot, Robots heard)
{
    if (team->discovered) {
        discovered_before_own_slot(team, slots, slot, heard);
    }
}

bool topology_out_of_step(void) { return discovered_out_of_step(); }

void topology_fell_back(void) { discovered_fell_back(); }

bool topology_wants_control(const Team *team, const Slots *slots)
{
    (void)slots;
    return team->discovered && discovered_wants_control();
}

uint32_t topology_control_frame(const Team *team, const Slots *slots, int64_t local_ns, uint8_t *bytes)
{
    return discovered_control_frame(team, slots, local_ns, bytes);
}

bool topology_adoption_ns(const Team *team, const Slots *slots, int64_t local_ns, int64_t *at_ns)
{
    if (team->discovered) {
        return discovered_adoption_ns(team, slots, at_ns);
    }
    *at_ns = slots_round_end_after(slots, local_ns);
    return requested(team, *at_ns) != current;
}

bool topology_adopt(const Team *team, int64_t at_ns, Robots *heard)
{
    if (team->discovered) {
        return discovered_adopt(team, heard);
    }
    Design design;
    current = requested(team, at_ns);
    team_design(team, current, &design);
    memcpy(heard, design.heard, sizeof design.heard);
    return true;
}
