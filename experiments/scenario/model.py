"""A scenario as it will be run: every default filled in, every name resolved, every time in integer nanoseconds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from firmware_sim.local_clock import ClockSettings

Link = tuple[str, str, str]             # (medium, sender, receiver)
Window = tuple[int, int]                # [start_ns, end_ns)


class Bound(msgspec.Struct, frozen=True):
    """What `[expect]` allows: min <= figure <= max, None where it is open."""

    min: float | None = None
    max: float | None = None


class PlantSpec(msgspec.Struct, frozen=True):
    fmu: str                            # name of an own model, or the absolute path of a .fmu
    parameters: dict[str, Any]


class AgentSpec(msgspec.Struct, frozen=True):
    """One node. `parameters` are the keyword arguments of the program's class after its first, the board."""

    name: str
    program: str                        # "package.module:Class"
    parameters: dict[str, Any]
    clock: ClockSettings
    plant: PlantSpec | None
    at_m: tuple[float, ...] | None
    media: tuple[str, ...]


class MediumSpec(msgspec.Struct, frozen=True):
    name: str
    kind: str
    settings: Any                       # an instance of MEDIA[kind].Settings
    nodes: tuple[str, ...]              # the agents with a port on it, in the order of the scenario


class ImpairmentSpec(msgspec.Struct, frozen=True):
    """`impairment_class(kind)(**fields, rng=...)` on each of `links`, within `windows_ns` (none: the whole run)."""

    place: str                          # "impairments[0]", names the random stream
    on: str
    links: tuple[Link, ...]
    windows_ns: tuple[Window, ...]
    kind: str                           # of the house, or "package.module:Class"
    fields: dict[str, Any]


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
    expect: dict[str, Bound]

    @property
    def folder(self) -> Path:
        """Where paths in the scenario start from, and where its own programs may lie."""
        return Path(self.path).parent

    def resolved(self) -> dict[str, Any]:
        """As plain JSON types, for the run folder."""
        return msgspec.json.decode(msgspec.json.encode(self, enc_hook=_plain), type=dict[str, Any])


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else str(value)
