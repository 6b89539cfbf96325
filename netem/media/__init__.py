"""Media: what carries frames between ports. A medium lives in the emulator process.

A member of this kind is a `Medium` (medium.py) with a settings class, and a line in the table (table.py). It takes
offers in the order (time, node name, sequence number) and answers one question for the conservative windows: when could
anything handed out at or after `t0_ns` reach a node at the earliest?
It puts its own events on the agenda it was built with, hands received copies to `Links.receive`, and closes in the
ledger every copy that does not get that far.

What the rest of the project has to know of a medium, the medium answers: before the run its settings
(`MediumSettings`), during the run the medium itself. Each question has a default, so a member answers only those that
concern it, and no caller asks which kind it holds.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar, NamedTuple

if TYPE_CHECKING:
    from netem.media.answers import Camera, FloorPlan, SerialFormat, ShownPose
    from netem.media.radio_presets import RadioPreset


class Shown(NamedTuple):
    """A table that `marconet check` prints."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


class MediumSettings:
    """Questions that the settings of every kind of medium answer before the run, with defaults."""

    carries_can_frames: ClassVar[bool] = False      # a program opens its port with python-can

    def shown(self, medium: str, nodes: Sequence[str]) -> list[Shown]:
        """Bounds and load of the medium of that name between `nodes`, known before the run."""
        return []

    def reports_own_frames_to(self, node: str) -> bool:
        """Whether `node` receives its own frames once they got through."""
        return False

    def links_to_themselves(self) -> Collection[str]:
        """The nodes with a link to themselves."""
        return ()

    def recorders(self, medium: str) -> Mapping[str, object]:
        """By kind, the settings of the recorders that the medium of that name asks for."""
        return {}

    def poses(self) -> Mapping[str, ShownPose]:
        """By node: which outputs of its plant the medium sees. A mistake in them is reported under the key `bodies`."""
        return {}

    def camera(self, observer: str) -> Camera | None:
        """How `observer` sees the nodes of `poses`; None: it sees none of them."""
        return None

    def floor_plan(self) -> FloorPlan | None:
        """What a view from above draws of the medium; None: nothing."""
        return None

    def radio(self) -> RadioPreset | None:
        """The radio that sends and receives its frames; None: it is no radio channel."""
        return None

    def serial_format(self) -> SerialFormat | None:
        """How it carries bytes one after the other; None: it does not."""
        return None
