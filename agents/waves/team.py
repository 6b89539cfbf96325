"""The `[team]` table of robots that agree by waves, which every robot knows beforehand."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, Literal

import msgspec

from agents.synchronization.graph import Edge
from agents.synchronization.team import TeamError
from agents.team_table import mistakes
from agents.waves.agent import Agent, read_agent
from agents.waves.port import WavePort
from agents.waves.wave_frame import MAX_ROBOTS, WaveFrameCodec
from firmware_sim.schedules.slotted_broadcast import SlottedBroadcast
from netem.core import link_pattern


class Model(msgspec.Struct, forbid_unknown_fields=True, frozen=True, dict=True):
    """The plant of a robot: with waves, ports' dampers included, and its second output the integral of the first."""

    A: list[list[float]]
    B: list[list[float]]
    C: list[list[float]]
    x0: list[float] = []

    @cached_property
    def plant(self) -> tuple[Agent, int | None]:
        return read_agent(self.A, self.B, self.C)


class WaveTeam(msgspec.Struct, forbid_unknown_fields=True, frozen=True, dict=True):
    """Robots are numbered in the order of `models`."""

    models: dict[str, Model]
    links: list[str]                                # "a <-> b": a line between a and b
    slot_s: float
    damping: float                                  # K of every port; with outputs, the gain of every link
    impedance: float = 0.0                          # b of every line, 0: as `damping`, so that nothing is reflected
    coupling: Literal["waves", "outputs"] = "waves"
    when_silent: Literal["zero", "hold"] = "zero"   # the wave after a period without a frame
    use_after_s: float = 0.0                        # with waves: from its slot's start until a wave is used; 0: at once
    own_value: Literal["at once", "late"] = "late"  # with outputs: when a robot uses the value that it sent itself
    guard_s: float = 0.0
    sure: bool = True                               # refuse what is not proved to converge
    own_late_ns: list[int] = []                     # by robot: delay of its own value, from `prepare`

    @cached_property
    def names(self) -> list[str]:
        return list(self.models)

    @property
    def waves(self) -> bool:
        return self.coupling == "waves"

    @cached_property
    def port(self) -> WavePort:
        return WavePort(self.damping, self.impedance or self.damping)

    @property
    def slot_ns(self) -> int:
        return round(self.slot_s * 1e9)

    @property
    def guard_ns(self) -> int:
        return round(self.guard_s * 1e9)

    @property
    def use_after_ns(self) -> int:
        return round(self.use_after_s * 1e9)

    @property
    def round_ns(self) -> int:
        return self.slot_ns * len(self.models)

    @cached_property
    def edges(self) -> list[Edge]:
        """Return every line in both directions, (sender, receiver), ascending; TeamError for a bad link."""
        found: set[Edge] = set()
        for index, link in enumerate(self.links):
            pattern = link_pattern.parse(link)
            pairs = [] if pattern is None or not pattern.both_ways else pattern.links(
                link_pattern.matching(pattern.sender, self.names), link_pattern.matching(pattern.receiver, self.names))
            if not pairs:
                raise TeamError(f'team.links[{index}]="{link}": expected "a <-> b" between two of '
                                f"{', '.join(self.names)}: a line has two ends, of which each sends")
            found |= {(self.names.index(sender), self.names.index(receiver)) for sender, receiver in pairs}
        return sorted(found)

    @cached_property
    def neighbours(self) -> list[list[int]]:
        return [[sender for sender, receiver in self.edges if receiver == i] for i in range(len(self.models))]

    @property
    def agents(self) -> list[Agent]:
        """The agents, with waves those behind the ports."""
        plants = [model.plant[0] for model in self.models.values()]
        if not self.waves:
            return plants
        return [plant.without_damping(self.port.own_damping * len(heard))
                for plant, heard in zip(plants, self.neighbours, strict=True)]

    def first_output(self, number: int) -> float:
        model = list(self.models.values())[number]
        return float(sum(c * x for c, x in zip(model.C[0], model.x0, strict=False)))

    @cached_property
    def schedule(self) -> SlottedBroadcast:
        return SlottedBroadcast(len(self.models), self.slot_ns, 0, self.guard_ns)

    @cached_property
    def codec(self) -> WaveFrameCodec:
        return WaveFrameCodec([2 * len(heard) if self.waves else 1 for heard in self.neighbours])


def read_wave_team(table: Mapping[str, Any]) -> WaveTeam:
    """Return the team; raises TeamError with every problem of the table."""
    try:
        team = msgspec.convert(table, WaveTeam)
    except msgspec.ValidationError as error:
        raise TeamError(*mistakes(table, WaveTeam, "team")) from error
    problems = list(_problems(team))
    if problems:
        raise TeamError(*problems)
    return team


def _problems(team: WaveTeam) -> list[str]:
    found = []
    if not 2 <= len(team.models) <= MAX_ROBOTS:
        found.append(f"team.models: {len(team.models)} robots: expected 2 to {MAX_ROBOTS}")
    for name, model in team.models.items():
        try:
            _, integral = model.plant
        except ValueError as error:
            found.append(f"team.models.{name}: {error}")
            continue
        if team.waves and integral is None:
            found.append(f"team.models.{name}.C: expected a second row, the integral of the output: a robot sends the "
                         "mean of its wave over a round, not a sample")
        if model.x0 and len(model.x0) != len(model.A):
            found.append(f"team.models.{name}.x0={model.x0}: expected {len(model.A)} values, one per state")
    if not 0 < team.slot_s < float("inf"):
        found.append(f"team.slot_s={team.slot_s}: expected more than 0")
    elif not 0 <= team.guard_s < team.slot_s / 2:
        found.append(f"team.guard_s={team.guard_s}: expected 0 or more, and less than half of team.slot_s="
                     f"{team.slot_s}")
    if not 0 <= team.use_after_s < float("inf"):
        found.append(f"team.use_after_s={team.use_after_s}: expected 0 or more")
    elif team.use_after_s and not team.waves:
        found.append(f'team.use_after_s={team.use_after_s}: goes with team.coupling = "waves"')
    try:
        _ = team.port
    except ValueError as error:
        found.append(f"team.{error}")
    try:
        _ = team.edges
    except TeamError as error:
        found += error.problems
    return found
