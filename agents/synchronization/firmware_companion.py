"""Checks a scenario for the synchronizing robot in C (`firmware_sim/firmware/synchronizing_robot`), and configures it.

`configure` turns the team's table, with the frame times and the designs that `prepare` adds to it, into the numbers
that are written into a robot's memory before it is deployed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from agents.synchronization.graph import Floats
from agents.synchronization.model_hold import Hold
from agents.synchronization.preparation import check, prepare
from agents.synchronization.robot import disturbance_pieces
from agents.synchronization.round_plans import Heard, RoundPlans, heard_by
from agents.synchronization.team import SYNC_GAIN, TableEntry, Team, TeamError, read_team
from firmware_sim.scenario_view import Own, ScenarioView

MAX_ROBOTS: Final = 16          # as in team.h
MAX_VALUES: Final = 4
MAX_PIECES: Final = 20          # as in robot.c
MAX_HOLDS: Final = 8            # as in robot.c: own values that wait at a time


class SyncFirmware:
    """The companion of the firmware synchronizing_robot."""

    @staticmethod
    def check(scenario: ScenarioView, own: Own[Any]) -> Iterator[str]:
        """Yield every reason why these robots cannot synchronize, or do not fit into the firmware."""
        found = list(check(scenario, own))
        yield from found
        for name, robot in own.items():
            if len(robot.settings.disturbance) > MAX_PIECES:
                yield (f"agents.{name}.parameters.disturbance: {len(robot.settings.disturbance)} pieces: the firmware "
                       f"synchronizing_robot holds {MAX_PIECES}")
            disturbance_pieces(robot.settings.disturbance)
        try:
            team = read_team(scenario.team)
        except TeamError:
            return                              # said above
        if len(team.names) > MAX_ROBOTS:
            yield f"team.models: {len(team.names)} robots: the firmware synchronizing_robot holds {MAX_ROBOTS}"
        if team.hold is not Hold.VALUE or any(model.observer_poles for model in team.models.values()):
            yield ("team: observer_poles and hold: the firmware synchronizing_robot has neither observers nor models; "
                   "leave them out, or use the robot in Python, agents.synchronization.robot:SyncRobot")
        for name, agent in zip(team.names, team.agents, strict=True):
            if max(agent.outputs, agent.inputs) > MAX_VALUES:
                yield (f"team.models.{name}: {agent.outputs} outputs, {agent.inputs} inputs: the firmware "
                       f"synchronizing_robot holds {MAX_VALUES}")

        if team.own_value == "late" and not found:
            prepared = read_team({**scenario.team, **prepare(scenario, own)})
            late_ns = max(prepared.own_delay_ns(number) for number in range(len(team.names)))
            round_ns = min(entry.slot_ns * len(entry.parts) for entry in prepared.designs)
            if late_ns >= (MAX_HOLDS - 1) * round_ns:
                yield (f'team.own_value="late": a robot would use its own value {late_ns} ns late: the firmware '
                       f"synchronizing_robot keeps {MAX_HOLDS} own values, expected less than "
                       f"{(MAX_HOLDS - 1) * round_ns} ns, {MAX_HOLDS - 1} rounds; shorten the delay, or use the robot "
                       "in Python")

    prepare = staticmethod(prepare)

    @staticmethod
    def configure(table: Mapping[str, Any], name: str, settings: Any) -> dict[str, Any]:
        """Return the rows of [[configuration]] for the robot `name`; `table` is the scenario's [team]."""
        team = read_team(table)
        number = team.names.index(name)
        agent = team.agents[number]
        plans = RoundPlans(team)
        designs = _designs(team)
        layout = team.layout
        outputs = [[float(value) for value in other.C @ (model.x0 or [0.0] * other.states)]
                   for model, other in zip(team.models.values(), team.agents, strict=True)]
        return {
            "number": number,
            "names": [byte for robot in team.names for byte in robot.encode() + b"\0"],
            "outputs": agent.outputs,
            "inputs": agent.inputs,
            "gain": [[float(entry) for entry in row] for row in agent.K],
            "bias": [list(bias) for bias in team.biases],
            "start_outputs": outputs if team.every_output_known else [],
            "disturbance_from_ns": [from_ns for from_ns, _ in disturbance_pieces(settings.disturbance)],
            "discovered": team.topology == "discovered",
            "request_from_ns": [round(request.from_s * 1e9) for request in team.requests],
            "request_design": [_design_of(designs, team.laplacian_of(request.links)) for request in team.requests],
            "repeat_ns": round(team.repeat_s * 1e9),
            "design_heard": [[sum(1 << j for j in heard) for heard in links] for links in designs],
            "design_part": [[_part_of(entry.parts, robot) for robot in range(len(team.names))]
                            for entry in designs.values()],
            "design_parts": [len(entry.parts) for entry in designs.values()],
            "design_slot_ns": [entry.slot_ns for entry in designs.values()],
            "design_certified_ns": [entry.certified_ns for entry in designs.values()],
            "design_assumed_ns": [entry.assumed_ns for entry in designs.values()],
            "boot_slot_ns": plans.boot().slot_ns,
            "guard_ns": round(team.guard_s * 1e9),
            "data_airtime_ns": layout.data_airtime_ns,
            "control_airtime_ns": layout.control_airtime_ns,
            "latency_ns": layout.latency_ns,
            "own_delay_ns": team.own_delay_ns(number),
            "slot_needs_ns": team.slot_needs_ns,
            "max_successive_losses": team.max_successive_losses,
            "resynchronize": team.resynchronize,
            "sync_gain": SYNC_GAIN,
            "sync_contraction": team.sync_contraction,
            "oldest_value_ns": team.oldest_value_ns,
            "watches_age": team.oldest_value_ns < 0 or not team.sure,
        }


def _designs(team: Team) -> dict[Heard, TableEntry]:
    """Return the designs by the robots that each hears, each topology once."""
    return {tuple(tuple(heard) for heard in entry.heard): entry for entry in team.designs}


def _design_of(designs: Mapping[Heard, TableEntry], laplacian: Floats) -> int:
    """Return the number of the design of a topology that is told, which `check` has proved to exist."""
    return list(designs).index(heard_by(laplacian))


def _part_of(parts: list[list[int]], robot: int) -> int:
    return next(index for index, part in enumerate(parts) if robot in part)
