/* team.h: what a robot knows of its team before it starts, from the parameters of its board.
 *
 * A set of robots is a word whose bit j stands for robot j. A design is a topology with its round plan: who hears whom,
 * the part of the round in which each robot sends, the slot length. Designs stay with the board's parameters.
 *
 * Not modelled: the computation of a design on the robot; a topology without a design is not adopted. */
#ifndef TEAM_H
#define TEAM_H

#include <stdbool.h>
#include <stdint.h>

enum { MAX_ROBOTS = 16, MAX_VALUES = 4 };      /* of a discovery frame; outputs or inputs of a robot */

typedef uint16_t Robots;

#define ONLY(robot) ((Robots)(1u << (robot)))
#define HAS(robots, robot) (((robots) >> (robot) & 1u) != 0)

typedef struct {
    uint32_t number, robots, outputs, inputs, designs, requests;
    bool discovered, resynchronize, watches_age;
    int64_t repeat_ns, boot_slot_ns, guard_ns, data_airtime_ns, control_airtime_ns, latency_ns, own_delay_ns;
    int64_t slot_needs_ns, max_successive_losses, oldest_value_ns;
    double sync_gain, sync_contraction;
} Team;

typedef struct {
    Robots heard[MAX_ROBOTS];       /* N_i of each robot i */
    uint8_t part[MAX_ROBOTS];
    int64_t parts, slot_ns, certified_ns, assumed_ns;
} Design;

/* Read the team; false if its robots or values are more than this firmware holds. */
bool team_read(Team *team);

/* The value `index` of a parameter, 0 if there is none. */
double team_value(uint32_t parameter, uint32_t index);
int64_t team_whole(uint32_t parameter, uint32_t index);

void team_design(const Team *team, uint32_t number, Design *design);

/* Find the design of the topology `heard`; false if there is none. */
bool team_find_design(const Team *team, const Robots *heard, Design *design);

/* The design before a topology is known: no links, and a slot for each robot. */
void team_boot_design(const Team *team, Design *design);

bool team_same_links(const Team *team, const Robots *heard, const Robots *others);

#endif
