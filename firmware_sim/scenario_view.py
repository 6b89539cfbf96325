"""What a program's `check(scenario)` sees of a scenario: who takes part, over which media, and what goes wrong.

The scenario is read by a package above. A program below it may ask these things, and yields one line for each mistake.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from firmware_sim.clock_settings import ClockSettings


class AgentView(Protocol):
    @property
    def program(self) -> str: ...
    @property
    def parameters(self) -> Mapping[str, Any]: ...
    @property
    def plant(self) -> Any | None: ...
    @property
    def at_m(self) -> tuple[float, ...] | None: ...
    @property
    def media(self) -> Sequence[str]: ...
    @property
    def clock(self) -> ClockSettings: ...


class MediumView(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def kind(self) -> str: ...
    @property
    def settings(self) -> Any: ...
    @property
    def nodes(self) -> tuple[str, ...]: ...


class ImpairmentView(Protocol):
    @property
    def place(self) -> str: ...
    @property
    def kind(self) -> str: ...
    @property
    def links(self) -> Sequence[tuple[str, str, str]]: ...          # (medium, sender, receiver)
    @property
    def windows_ns(self) -> Sequence[tuple[int, int]]: ...          # none: the whole run
    @property
    def fields(self) -> Mapping[str, Any]: ...


class ScenarioView(Protocol):
    @property
    def length_ns(self) -> int: ...
    @property
    def team(self) -> Mapping[str, Any]: ...
    @property
    def agents(self) -> Mapping[str, AgentView]: ...
    @property
    def media(self) -> Mapping[str, MediumView]: ...
    @property
    def impairments(self) -> Sequence[ImpairmentView]: ...
