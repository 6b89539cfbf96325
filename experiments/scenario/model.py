"""The scenario that a run takes: every default filled in, every name resolved, every time in integer nanoseconds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

import msgspec

from firmware_sim.clock_settings import ClockSettings
from firmware_sim.ground_plan import GroundPlan
from netem.gateways.network_settings import NetworkSettings
from netem.gateways.real_time_settings import RealTimeSettings
from netem.media.answers import FloorPlan

Link = tuple[str, str, str]             # (medium, sender, receiver)
Window = tuple[int, int]                # [start_ns, end_ns)


class Bound(msgspec.Struct, frozen=True):
    """An entry of `[expect]`: min <= figure <= max, None: no bound; over [start, end) of the run, if given.

    With a `formula` the figure is its robustness, and without min and max the run has to satisfy it. With a `share` it
    is a campaign that has to show that this share of its runs, at least, keeps the bound; a single run may break it.
    """

    min: float | None = None
    max: float | None = None
    during_ns: Window | None = None
    formula: str = ""
    links: dict[str, tuple[Link, ...]] = {}     # those of each selector in the formula
    share: float | None = None                  # None: every run has to keep it


class PlantSpec(msgspec.Struct, frozen=True):
    fmu: str                            # name of an own model, or the absolute path of a .fmu
    parameters: dict[str, Any]
    step_ns: int | None = None          # step of an FMU whose description does not name it


class AgentSpec(msgspec.Struct, frozen=True):
    """One node. `parameters` are the keyword arguments of the program's class after its first, the board."""

    name: str
    program: str                        # "package.module:Class"
    parameters: dict[str, Any]
    clock: ClockSettings
    plant: PlantSpec | None
    at_m: tuple[float, ...] | None
    media: tuple[str, ...]
    zenoh: tuple[tuple[str, str], ...] = ()     # (key expression, medium); (): the only medium that can carry Zenoh
    sockets: dict[str, str] = {}        # medium -> "bare", "ip" or "ADDRESS/BITS", see socket_addresses.py


def positions(nodes: Iterable[str], agents: Mapping[str, AgentSpec]) -> dict[str, tuple[float, ...] | None]:
    """Return the positions of nodes [m], None for an agent without one and for a gateway."""
    return {node: agents[node].at_m if node in agents else None for node in nodes}


class MediumSpec(msgspec.Struct, frozen=True):
    name: str
    kind: str
    settings: Any                       # an instance of MEDIA[kind].Settings
    nodes: tuple[str, ...]              # the agents with a port on it, in the order of the scenario
    floor_plan: FloorPlan | None = None     # data for a view from above


class GatewaySpec(msgspec.Struct, frozen=True):
    """A connection to a device or program outside the run, with a port on `medium` like a node."""

    name: str
    medium: str
    kind: str
    settings: Any                       # an instance of GATEWAYS[kind].Settings
    timesync: bool = False              # it asks the device for its clock


class ImpairmentSpec(msgspec.Struct, frozen=True):
    """`impairment_class(kind)(**fields, rng=...)` on each of `links`, within `windows_ns` (none: the whole run)."""

    place: str                          # "impairments[0]"
    on: str
    links: tuple[Link, ...]
    windows_ns: tuple[Window, ...]
    kind: str                           # name in the table of impairments, or "package.module:Class"
    fields: dict[str, Any]
    name: str = ""                      # name given by the author, unique; "": none
    shared: bool = False                # one impairment for all links, instead of one for each

    @property
    def called(self) -> str:
        """The name of its random streams: `name`, else its place."""
        return self.name or self.place

    @property
    def cause(self) -> str:
        """Its name in the ledger."""
        return f"{self.called} {self.kind}"


class DerivedSpec(msgspec.Struct, frozen=True):
    """Signals that `function` computes after the run from those named in `of` ("node.signal")."""

    function: str                       # "package.module:function"
    of: tuple[str, ...]
    signals: dict[str, str]             # name -> unit
    parameters: dict[str, Any]


class FaultSpec(msgspec.Struct, frozen=True):
    """A fault and all its occurrences, (start_ns, end_ns), in a run of the scenario's seed and length."""

    place: str                          # "faults[0]"
    name: str                           # name given by the author, unique; "": none
    kind: str
    on: str
    targets: tuple[tuple[str, ...], ...]        # (node,), (medium,) or (medium, sender, receiver)
    settings: Any                       # an instance of FAULTS[kind]
    occurrences: tuple[tuple[int, int], ...]
    at_random: bool = False             # drawn at random times, so that occurrences may meet others

    @property
    def called(self) -> str:
        """The name of its random streams: `name`, else its place."""
        return self.name or self.place

    @property
    def cause(self) -> str:
        """Its name in the ledger and in events."""
        return f"{self.called} {self.kind}"


class GuaranteeSpec(msgspec.Struct, frozen=True):
    """A requirement that `MONITORS[kind](**fields)` judges on each of `subjects`, over the whole run."""

    kind: str
    on: str
    subjects: tuple[tuple[str, ...], ...]       # links, senders, signals, events or sights, depending on the kind
    expected: Literal["holds", "violated"]
    fields: dict[str, Any]
    unit: str                                   # unit of worst value and margin: "s", or "" for plain numbers
    share: float | None = None                  # as of a Bound: of the runs that are as expected


class CostSpec(msgspec.Struct, frozen=True):
    """A figure that grows with time: what `COSTS[kind](**fields)` has come to at the end."""

    kind: str
    fields: dict[str, Any]
    unit: str                                   # "J", or "" for a plain number
    nodes: tuple[str, ...]                      # those with a part of their own
    signals: tuple[str, ...]                    # "node.signal" that it is computed from


class Scenario(msgspec.Struct, frozen=True):
    name: str
    path: str
    question: str
    seed: int
    length_ns: int
    sample_period_ns: int
    node_timeout_s: float
    team: dict[str, Any]
    agents: dict[str, AgentSpec]
    media: dict[str, MediumSpec]
    impairments: tuple[ImpairmentSpec, ...]
    gateways: dict[str, GatewaySpec]
    derived: dict[str, DerivedSpec]
    expect: dict[str, Bound]            # with those implied by the guarantees
    guarantees: dict[str, GuaranteeSpec] = {}
    records: dict[str, Any] = {}        # instances of RECORDERS[kind].Settings, by kind
    faults: tuple[FaultSpec, ...] = ()
    costs: dict[str, CostSpec] = {}
    question_signal: str = ""           # "node.signal", each a pattern; "": the report shows outputs first
    modes: dict[str, tuple[str, ...]] = {}      # of the automata that programs declare, by agent
    ground: GroundPlan | None = None    # on which the team acts, if its programs declare it
    real_time: RealTimeSettings = RealTimeSettings()    # for a run in real time
    network: NetworkSettings = NetworkSettings()        # how the doors of a run are locked
    changes: dict[str, Any] = {}        # values that replaced those of the file at `path`, by their paths in it

    @property
    def folder(self) -> Path:
        """The folder to which paths in the scenario are relative, and in which programs are looked for first."""
        return Path(self.path).parent

    def resolved(self) -> dict[str, Any]:
        """Return the scenario as plain JSON types, for the run folder."""
        return msgspec.json.decode(msgspec.json.encode(self, enc_hook=_plain), type=dict[str, Any])


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else str(value)
