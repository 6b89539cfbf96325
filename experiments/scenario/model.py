"""A scenario as it will be run: every default filled in, every name resolved, every time in integer nanoseconds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

import msgspec

from firmware_sim.clock_settings import ClockSettings
from netem.media.answers import FloorPlan

Link = tuple[str, str, str]             # (medium, sender, receiver)
Window = tuple[int, int]                # [start_ns, end_ns)


class Bound(msgspec.Struct, frozen=True):
    """What `[expect]` allows: min <= figure <= max, None where it is open; over [start, end) of the run, if given."""

    min: float | None = None
    max: float | None = None
    during_ns: Window | None = None


class PlantSpec(msgspec.Struct, frozen=True):
    fmu: str                            # name of an own model, or the absolute path of a .fmu
    parameters: dict[str, Any]
    step_ns: int | None = None          # of an FMU whose description does not say it


class AgentSpec(msgspec.Struct, frozen=True):
    """One node. `parameters` are the keyword arguments of the program's class after its first, the board."""

    name: str
    program: str                        # "package.module:Class"
    parameters: dict[str, Any]
    clock: ClockSettings
    plant: PlantSpec | None
    at_m: tuple[float, ...] | None
    media: tuple[str, ...]


def positions(nodes: Iterable[str], agents: Mapping[str, AgentSpec]) -> dict[str, tuple[float, ...] | None]:
    """Where nodes stand [m], as far as that is said; a gateway stands nowhere."""
    return {node: agents[node].at_m if node in agents else None for node in nodes}


class MediumSpec(msgspec.Struct, frozen=True):
    name: str
    kind: str
    settings: Any                       # an instance of MEDIA[kind].Settings
    nodes: tuple[str, ...]              # the agents with a port on it, in the order of the scenario
    floor_plan: FloorPlan | None = None     # what a view from above shows of it


class GatewaySpec(msgspec.Struct, frozen=True):
    """Somebody outside who stands on `medium` like a node."""

    name: str
    medium: str
    kind: str
    settings: Any                       # an instance of GATEWAYS[kind].Settings


class ImpairmentSpec(msgspec.Struct, frozen=True):
    """`impairment_class(kind)(**fields, rng=...)` on each of `links`, within `windows_ns` (none: the whole run)."""

    place: str                          # "impairments[0]"
    on: str
    links: tuple[Link, ...]
    windows_ns: tuple[Window, ...]
    kind: str                           # of the house, or "package.module:Class"
    fields: dict[str, Any]
    name: str = ""                      # by which its author calls it; no two have the same

    @property
    def called(self) -> str:
        """Name of its random streams, and of its losses in the ledger: `name`, else its place."""
        return self.name or self.place


class DerivedSpec(msgspec.Struct, frozen=True):
    """Signals that `function` works out after the run from those named in `of` ("node.signal")."""

    function: str                       # "package.module:function"
    of: tuple[str, ...]
    signals: dict[str, str]             # name -> unit
    parameters: dict[str, Any]


class GuaranteeSpec(msgspec.Struct, frozen=True):
    """What `MONITORS[kind](**fields)` watches on each of `subjects`, over the whole run."""

    kind: str
    on: str
    subjects: tuple[tuple[str, ...], ...]       # links, senders, signals or events, as the kind has it
    expected: Literal["holds", "violated"]
    fields: dict[str, Any]
    unit: str                                   # of its worst value and its margin: "s", or "" for plain numbers


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
    expect: dict[str, Bound]            # with what the guarantees imply
    guarantees: dict[str, GuaranteeSpec] = {}
    records: dict[str, Any] = {}        # instances of RECORDERS[kind].Settings, by kind
    question_signal: str = ""           # "node.signal", each a pattern; "": the report shows outputs first

    @property
    def folder(self) -> Path:
        """Where paths in the scenario start from, and where its own programs may lie."""
        return Path(self.path).parent

    def resolved(self) -> dict[str, Any]:
        """As plain JSON types, for the run folder."""
        return msgspec.json.decode(msgspec.json.encode(self, enc_hook=_plain), type=dict[str, Any])


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else str(value)
