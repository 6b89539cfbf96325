"""Recorders: what consumes every frame on the air, settled copy, sample and event of a run, and leaves a file of it.

A member of this kind is a `Recorder` with a settings class, and a line in the table (table.py). The run builds it as
`Member(settings, place)`; its verb `record` says what it wants of the run. Nothing is made for what nobody wants.

The ledger is no member: media count copies in it, and the run is checked against it. It is where copies are settled, so
that a recorder hears of a fate once, when it is final, in the order of the ledger.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

if TYPE_CHECKING:
    from netem.core.frame import Frame
    from netem.records.events import Event
    from netem.records.ledger import Row

Declare = Callable[[str, Sequence[tuple[str, str]]], None]      # (node, (name, unit) of its signals)
Sample = Callable[[str, int, Sequence[float]], None]            # (node, time_ns, one value for each signal)


@dataclass(frozen=True)
class Place:
    """Where a recorder writes, and what it may write about the run."""

    folder: Path
    metadata: Mapping[str, str]             # scenario and seed
    scenario: bytes                         # the resolved scenario as JSON
    end_ns: int                             # nothing at or after it belongs to the run


class FrameTap(Protocol):
    """Takes the frames of media, as a medium comes to know of them: an instant may lie ahead, also beyond the end."""

    def frame(self, frame: Frame, seen_ns: int) -> None:
        """`frame` was on the air in [frame.on_air_ns, frame.end_ns) with the bytes `frame.data`; at `seen_ns` a
        receiver has it whole. Its sender, medium and number are those of its copies in the ledger."""

    def error_frame(self, medium: str, time_ns: int) -> None:
        """An error frame of a CAN bus began at `time_ns`."""


@dataclass
class Feed:
    """What a run tells: lists that a recorder puts functions into, before the first grant."""

    frames: dict[str, list[FrameTap]] = field(default_factory=dict)             # by medium
    copies: list[Callable[[Sequence[Row]], None]] = field(default_factory=list)     # settled ones, some at a time
    declared: list[Declare] = field(default_factory=list)                       # before a node's first sample
    samples: list[Sample] = field(default_factory=list)
    events: list[Callable[[Event], None]] = field(default_factory=list)         # as told, not in order of time

    def declare(self, node: str, signals: Sequence[tuple[str, str]]) -> None:
        for tell in self.declared:
            tell(node, signals)

    def event(self, event: Event) -> None:
        for tell in self.events:
            tell(event)

    def sampler(self) -> Sample:
        """The function that tells every one of `samples`, as they are now."""
        if len(self.samples) == 1:
            return self.samples[0]
        listeners = tuple(self.samples)

        def sample(node: str, time_ns: int, values: Sequence[float]) -> None:
            for tell in listeners:
                tell(node, time_ns, values)

        return sample


@dataclass(frozen=True)
class NoSettings:
    """Of a recorder that has none."""


class Recorder:
    """A recorder. `Settings` is a dataclass, `FILES` names the files that it may leave; "{medium}" stands in them for
    the name of any medium."""

    Settings: ClassVar[type[Any]] = NoSettings
    FILES: ClassVar[tuple[str, ...]] = ()

    def __init__(self, settings: Any, place: Place) -> None:
        self.settings = settings
        self.place = place

    def record(self, run: Feed) -> None:
        """Put functions into the lists of `run`. Raises ValueError if it does not have what the settings ask for."""
        raise NotImplementedError

    def keep(self) -> None:
        """Put on the disk what there is so far, for the case that this process is killed."""

    def finish(self) -> None:
        """The run has ended or was broken off: close the files, which have their names only now."""
