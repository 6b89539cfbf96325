"""The `[team]` table of a scenario, which every robot of a synchronizing team knows beforehand."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache
from typing import Any, Final, Literal

import msgspec
import numpy as np

from agents.synchronization.closed_loop import LinearAgent
from agents.synchronization.graph import Floats, laplacian
from agents.synchronization.model_hold import Hold
from agents.synchronization.observer import pole_problems
from agents.synchronization.slot_length import Bound
from agents.team_table import mistakes
from netem.core import link_pattern

SYNC_GAIN: Final = 0.5              # share of the mean error of its clock that a robot corrects per round


class TeamError(ValueError):
    """The team table is wrong; the text has one line for each problem."""

    def __init__(self, *problems: str) -> None:
        super().__init__("; ".join(problems))
        self.problems = problems


class Model(msgspec.Struct, forbid_unknown_fields=True, frozen=True, dict=True):
    """Matrices of (6.5) and (6.6), the plant's start values `x0`, and the poles of an observer."""

    A: list[list[float]]
    B: list[list[float]]
    C: list[list[float]]
    K: list[list[float]]
    x0: list[float] = []
    d: list[float] = []             # bias of (6.6), zero when absent
    observer_poles: list[float] = []    # [1/s], one for each state that (A, C) shows; empty: no observer
    observer_x0: list[float] = []       # where the observer starts, zero when absent

    @cached_property
    def agent(self) -> LinearAgent:
        return LinearAgent(np.array(self.A), np.array(self.B), np.array(self.C), np.array(self.K))

    @property
    def observer_start(self) -> Floats:
        return np.array(self.observer_x0) if self.observer_x0 else np.zeros(self.agent.states)


class Request(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A topology requested from `from_s` on; a link "a -> b" means that b uses the outputs that a broadcasts."""

    from_s: float
    links: list[str]


class Layout(msgspec.Struct, frozen=True):
    """Frame times on the medium, computed before the run, the same for all robots."""

    data_airtime_ns: int = 0
    control_airtime_ns: int = 0
    latency_ns: int = 0             # from the end of a frame to its reception

    def control_offset_ns(self, slot_ns: int) -> int:
        """Return the start of the control sub-slot within a slot [ns].

        Of the time that the two frames leave free, two thirds lie between them and one third after the second."""
        free_ns = slot_ns - self.data_airtime_ns - self.control_airtime_ns
        return self.data_airtime_ns + 2 * free_ns // 3


class TableEntry(msgspec.Struct, frozen=True):
    """A round plan computed before the run: the robots that each hears, the parts of a round and the slot length."""

    heard: list[list[int]]
    parts: list[list[int]]
    slot_ns: int
    certified_ns: int = 0           # slot length by (6.20), if `slot_ns` differs from it; 0: the same
    assumed_ns: int = 0             # longest delay of its links, with which the exact loop is stable; 0: unknown


class Team(msgspec.Struct, forbid_unknown_fields=True, frozen=True, dict=True):
    """Robots are numbered in the order of `models`."""

    models: dict[str, Model]
    topology: Literal["told", "discovered"] = "discovered"
    requests: list[Request] = []            # with "told": the topologies, in order of time
    repeat_s: float = 0.0                   # with "told": period with which the requests repeat, 0: none
    every_output_known: bool = False        # True: at the start every robot knows every y(0)
    max_successive_losses: int = 0          # N^D of Remark 16
    kappa: float = 0.999                    # Remark 15
    slot_bound: Bound = Bound.PRINTED       # which certified bound gives the slot length, see `slot_length.py`
    guard_s: float = 0.0
    boot_slot_s: float = 1e-3               # slot length until the first topology is known
    slot_quantum_s: float = 1e-9            # slot lengths are rounded down to a multiple of it
    resynchronize: bool = False             # correct the local clock by the arrival times of the others' frames
    sure: bool = True                       # refuse delays and slot lengths for which stability is not proved
    own_value: Literal["at once", "late"] = "at once"   # when a robot uses the value that it broadcast itself
    slot_us: float = 0.0                    # without `sure`, or with models: the slot length, 0: the certified one
    hold: Hold = Hold.VALUE                 # what a robot uses of another between its frames, see `model_hold.py`
    hold_steps: int = 4                     # with models: control instants in each slot
    layout: Layout = Layout()
    designs: list[TableEntry] = []
    sync_contraction: float = 0.0           # largest factor of the clocks' differences per round, 0: unknown
    own_late_ns: list[int] = []             # by robot: added delay of its values to those that use them
    oldest_value_ns: int = 0                # greatest age of a value on arrival that the links allow, -1: unknown

    @cached_property
    def names(self) -> list[str]:
        return list(self.models)

    @cached_property
    def agents(self) -> list[LinearAgent]:
        return [model.agent for model in self.models.values()]

    @cached_property
    def outputs(self) -> int:
        return self.agents[0].outputs

    @cached_property
    def biases(self) -> list[tuple[float, ...]]:
        return [tuple(model.d) or (0.0,) * self.outputs for model in self.models.values()]

    @cached_property
    def values_per_frame(self) -> int:
        """Numbers in a sync frame: the outputs, or the largest state, and for "sender" a sum of outputs."""
        if self.hold is Hold.VALUE:
            return self.outputs
        return max(agent.states for agent in self.agents) + (self.outputs if self.hold is Hold.SENDER else 0)

    @property
    def slot_needs_ns(self) -> int:
        """Time for the frames of one slot and their guard times; with discovery, control frame and receive latency."""
        layout = self.layout
        guard_ns = round(self.guard_s * 1e9)
        if self.topology == "told":
            return layout.data_airtime_ns + 2 * guard_ns
        return layout.data_airtime_ns + layout.control_airtime_ns + layout.latency_ns + 3 * guard_ns

    @property
    def data_delay_ns(self) -> int:
        """Time from the start of a slot until its value has come, without impairments."""
        return self.layout.data_airtime_ns + self.layout.latency_ns

    def own_delay_ns(self, number: int) -> int:
        """Time from the start of its slot until this robot uses the value that it broadcast itself."""
        late_ns = self.own_late_ns[number] if self.own_value == "late" and self.own_late_ns else 0
        return self.data_delay_ns + late_ns

    def laplacian_of(self, links: list[str]) -> Floats:
        """Return the Laplacian of links "a -> b" between robot names; TeamError for a bad link."""
        edges = []
        for link in links:
            pattern = link_pattern.parse(link)
            found = [] if pattern is None else pattern.links(link_pattern.matching(pattern.sender, self.names),
                                                             link_pattern.matching(pattern.receiver, self.names))
            if not found:
                raise TeamError(f'link "{link}": expected "sender -> receiver" with names of {self.names}')
            edges += [(self.names.index(sender), self.names.index(receiver)) for sender, receiver in found]
        return laplacian(len(self.models), edges)


def read_team(table: Mapping[str, Any]) -> Team:
    """Return the team table as a `Team`; raises TeamError with all problems.

    All robots of a process, and all runs, have the `Team` of equal tables in common.
    """
    try:
        encoded = msgspec.msgpack.encode(dict(table))
    except (TypeError, OverflowError):          # a value that no file has
        return _read(table)
    return _remembered(encoded)


@lru_cache(maxsize=16)
def _remembered(encoded: bytes) -> Team:
    return _read(msgspec.msgpack.decode(encoded))


def _read(table: Mapping[str, Any]) -> Team:
    try:
        team = msgspec.convert(table, Team)
    except msgspec.ValidationError as error:
        raise TeamError(*mistakes(table, Team, "team")) from error
    problems = []
    if not team.models:
        problems.append("team.models: expected at least one robot's A, B, C, K")
    for name, model in team.models.items():
        try:
            outputs = model.agent.outputs
        except ValueError as error:
            problems.append(f"team.models.{name}: {error}")
            continue
        if model.d and len(model.d) != outputs:
            problems.append(f"team.models.{name}.d={model.d}: expected {outputs} values, one per output")
        if model.x0 and len(model.x0) != model.agent.states:
            problems.append(f"team.models.{name}.x0={model.x0}: expected {model.agent.states} values, one per state")
        if model.observer_poles:
            problems += [f"team.models.{name}.observer_poles={model.observer_poles}: {problem}"
                         for problem in pole_problems(model.agent, model.observer_poles)]
        if model.observer_x0 and len(model.observer_x0) != model.agent.states:
            problems.append(f"team.models.{name}.observer_x0={model.observer_x0}: expected {model.agent.states} "
                            "values, one per state")
    if team.max_successive_losses < 0:
        problems.append(f"team.max_successive_losses={team.max_successive_losses}: expected 0 or more")
    if not 0 < team.kappa < 1:
        problems.append(f"team.kappa={team.kappa}: expected 0 < kappa < 1 (Remark 15)")
    for key in ("guard_s", "repeat_s"):
        if getattr(team, key) < 0:
            problems.append(f"team.{key}={getattr(team, key)}: expected 0 or more")
    for key in ("boot_slot_s", "slot_quantum_s"):
        if getattr(team, key) <= 0:
            problems.append(f"team.{key}={getattr(team, key)}: expected more than 0")
    if team.requests and 0 < team.repeat_s <= team.requests[-1].from_s:
        problems.append(f"team.repeat_s={team.repeat_s}: expected more than the last request's from_s, "
                        f"{team.requests[-1].from_s}")
    if not 0 <= team.slot_us < float("inf"):
        problems.append(f"team.slot_us={team.slot_us}: expected 0 or more microseconds")
    elif team.slot_us and team.sure and team.hold is Hold.VALUE:
        problems.append(f"team.slot_us={team.slot_us}: the slot length follows from (6.20); set team.sure = false to "
                        "choose one without a proof")
    problems += _hold_problems(team)
    if team.topology == "discovered" and len(team.models) < 2:
        problems.append("team.models: a topology can be discovered by 2 robots or more")
    if team.topology == "told" and (not team.requests or team.requests[0].from_s != 0):
        problems.append("team.requests: a told topology needs a first request with from_s = 0")
    if problems:
        raise TeamError(*problems)
    return team


def _hold_problems(team: Team) -> list[str]:
    """Return what a team whose robots run each other's models lacks."""
    if team.hold is Hold.VALUE:
        return []
    place, problems = f'team.hold="{team.hold.value}"', []
    if team.topology != "told" or len(team.requests) > 1:
        problems.append(f'{place}: the models need one topology that all robots know: set topology = "told" with one '
                        "request")
    if not team.slot_us:
        problems.append(f"{place}: (6.20) gives slots for values that are held: write slot_us, which check judges by "
                        "the exact map")
    if lacking := [name for name, model in team.models.items() if not model.observer_poles]:
        problems.append(f"{place}: robots broadcast their states, which no robot measures: write observer_poles for "
                        + ", ".join(lacking))
    if not 1 <= team.hold_steps <= 1000:
        problems.append(f"team.hold_steps={team.hold_steps}: expected 1 to 1000 control instants in a slot")
    if team.own_value == "late":
        problems.append(f'{place}: a frame is brought forward by its delay: leave own_value = "late" out')
    return problems
