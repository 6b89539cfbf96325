"""The scenario as a program's `check` and `prepare` get it: agents, media, impairments and the team's table.

    check(scenario, own)    yields one line for each problem            own: the agents that run this program, by name
    prepare(scenario, own)  returns additions to the table `team`, which every robot knows; one that takes seconds may
                            take `progress: Preparing = unseen` besides, and call it as it goes

These are Protocols; a package above reads the scenario.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from firmware_sim.clock_settings import ClockSettings

Settings = TypeVar("Settings")


Preparing = Callable[[str, int, int], None]     # what is prepared, steps done, of how many


def unseen(what: str, done: int, steps: int) -> None:
    """Drop what a `prepare` tells of its progress; the default where no caller wants to show it."""


class AgentView(Protocol):
    """An agent with any program."""

    @property
    def program(self) -> str: ...
    @property
    def parameters(self) -> Mapping[str, Any]:
        """Those that the scenario gives, with times in ns; defaults of the program are not among them."""
    @property
    def plant(self) -> Any | None: ...
    @property
    def at_m(self) -> tuple[float, ...] | None: ...
    @property
    def media(self) -> Sequence[str]: ...
    @property
    def clock(self) -> ClockSettings: ...


@dataclass(frozen=True)
class OwnAgent(Generic[Settings]):
    """An agent that runs the checking program; `settings` is an instance of the program's `Settings`."""

    name: str
    settings: Settings
    agent: AgentView

    @property
    def media(self) -> Sequence[str]:
        """The media of the agent, which are the names of its ports."""
        return self.agent.media

    @property
    def has_plant(self) -> bool:
        return self.agent.plant is not None


Own = Mapping[str, OwnAgent[Settings]]


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
    @property
    def shared(self) -> bool: ...                                   # one impairment for all links


class ScenarioView(Protocol):
    @property
    def seed(self) -> int: ...
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
