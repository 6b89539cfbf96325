"""Recorders: each receives frames on the air, settled copies, samples or events of a run and writes a file of them.

A member of this kind is a `Recorder` with a settings class, and a line in the table (table.py). The run builds it as
`Member(settings, place)` and calls its verb `record`, with which it subscribes. Frames, copies and samples without a
subscriber cost nothing.

The ledger is no member: media count copies in it, and the run is checked against it. It settles the copies, so a
recorder receives each fate once, when it is final, in the order of the ledger.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from netem.records.sampler import Sampler

if TYPE_CHECKING:
    from netem.core.frame import Frame
    from netem.records.events import Event
    from netem.records.ledger import Row

Declare = Callable[[str, Sequence[tuple[str, str]]], None]      # (node, (name, unit) of its signals)
Sample = Callable[[str, int, Sequence[float]], None]            # (node, time_ns, one value for each signal)


class Carried(Protocol):
    """What the frames of a medium are: its settings, or their class."""

    @property
    def link_type(self) -> int:
        """The link type of its frames in captures, by the list of tcpdump.org."""
    @property
    def carries_can_frames(self) -> bool: ...
    @property
    def shows_bodies(self) -> bool:
        """Whether its frames are sights of their senders, who sent nothing."""

    @staticmethod
    def captured(data: bytes) -> bytes:
        """Return the bytes of a frame as captures of its link type hold them; of b"", those of an error frame."""


@dataclass(frozen=True)
class Place:
    """The folder of a recorder's files, and facts about the run to write into them."""

    folder: Path
    metadata: Mapping[str, str]             # scenario and seed
    scenario: bytes                         # the resolved scenario as JSON
    end_ns: int                             # the run is [0, end_ns)
    media: Mapping[str, Carried] = field(default_factory=dict)
    run: Path | None = None                 # folder of the run, if its files go to another one afterwards

    @property
    def recorded(self) -> Path:
        """The folder with the ledger and the files of other recorders."""
        return self.folder if self.run is None else self.run


class FrameTap(Protocol):
    """Receives the frames of a medium as soon as the medium has decided about them.

    An instant may therefore lie after the present, even after the end of the run.
    """

    def frame(self, frame: Frame, seen_ns: int) -> None:
        """Take a frame with the bytes `frame.data` that is on the air in [frame.on_air_ns, frame.end_ns).

        At `seen_ns` a receiver has all of it. The copies of the frame in the ledger have its medium, sender and number.
        """

    def error_frame(self, medium: str, time_ns: int) -> None:
        """Take the start of an error frame on a CAN bus."""


@dataclass
class Feed:
    """The subscriptions to a run: before the first grant a recorder adds functions to these lists."""

    frames: dict[str, list[FrameTap]] = field(default_factory=dict)             # by medium
    copies: list[Callable[[Sequence[Row]], None]] = field(default_factory=list)     # settled ones, some at a time
    declared: list[Declare] = field(default_factory=list)                       # before a node's first sample
    samples: list[Sample] = field(default_factory=list)
    events: list[Callable[[Event], None]] = field(default_factory=list)         # in order of arrival, not of time

    def declare(self, node: str, signals: Sequence[tuple[str, str]]) -> None:
        for tell in self.declared:
            tell(node, signals)

    def event(self, event: Event) -> None:
        for tell in self.events:
            tell(event)

    def sampler(self) -> Sample:
        """Return a function that calls all present members of `samples`."""
        return self.samples[0] if len(self.samples) == 1 else Sampler(self.samples).sample


@dataclass(frozen=True)
class NoSettings:
    """The settings of a recorder without any."""


class NoSuchFormat(ValueError):
    """A medium has frames of which a recorder's format cannot be made."""

    exit_code = 2


class Recorder:
    """Base class of all recorders.

    `Settings` is a dataclass. `FILES` names the files that the recorder may write; "{medium}" and "{node}" in a name
    stand for the name of any medium or node.

    A recorder with `NEEDS` writes its files in `finish`, from the files of other recorders and from the ledger in the
    folder of the run. The run has these recorders too, and finishes them first.
    """

    Settings: ClassVar[type[Any]] = NoSettings
    FILES: ClassVar[tuple[str, ...]] = ()
    NEEDS: ClassVar[tuple[str, ...]] = ()       # kinds of other recorders

    @classmethod
    def check(cls, settings: Any, media: Mapping[str, Carried]) -> Iterable[str]:
        """Yield a line for each reason why `settings` do not fit a run with these media."""
        return ()

    @classmethod
    def afterwards(cls, media: Mapping[str, Carried], chosen: str | None, asked: Any | None) -> Sequence[Any]:
        """Return the settings of the recorders that write such files after a run that kept its frames.

        They are about the medium `chosen`, None: about all media that the format fits. `asked` has the settings of the
        recorder in the scenario, if it had any. Raises NoSuchFormat.
        """
        raise NoSuchFormat("this recorder writes during a run only")

    def __init__(self, settings: Any, place: Place) -> None:
        self.settings = settings
        self.place = place

    def record(self, run: Feed) -> None:
        """Subscribe to `run` by adding functions to its lists. Raises ValueError if the settings do not fit the run."""
        raise NotImplementedError

    def keep(self) -> None:
        """Write the records so far to the disk, so that they outlive this process if it is killed."""

    def finish(self) -> None:
        """Close the files and give them their final names, after the run has ended or was aborted."""
