"""Media: models that carry frames between the ports of nodes, in the emulator process.

A member of this kind is a `Medium` (medium.py) with a settings class, and a line in the table (table.py). It takes
offers in the order (time, node name, sequence number) and tells the conductor, for the conservative windows, the
earliest instant at which a frame offered at or after `t0_ns` can reach a node.
It schedules its events on the agenda it was built with, passes received copies to `Links.receive`, and closes every
other copy in the ledger.

Callers ask the settings of a medium (`MediumSettings`) before the run and the medium during the run. Each question has
a default, so a member answers only those that concern it, and no caller compares kinds.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar, NamedTuple

if TYPE_CHECKING:
    from netem.media.answers import Camera, DatagramFormat, FloorPlan, SerialFormat, ShownPose
    from netem.media.radio_presets import RadioPreset
    from netem.topology import WeakArea


class Shown(NamedTuple):
    """A table that `marconet check` prints."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


class MediumSettings:
    """Questions that the settings of every kind of medium answer before the run, with defaults."""

    strikable: ClassVar[frozenset[str]] = frozenset({"links"})      # parts that faults strike: Fault.strikes
    link_type: ClassVar[int] = 151                  # of its frames in captures: USER4, by the list of tcpdump.org
    carries_can_frames: ClassVar[bool] = False      # True: a program opens its port with python-can
    shows_bodies: ClassVar[bool] = False            # True: a copy is a sight of its sender, who sent nothing
    poses_key: ClassVar[Sequence[str]] = ("bodies",)    # where a scenario names what `poses` returns

    @staticmethod
    def captured(data: bytes) -> bytes:
        """Return the bytes of a frame as captures of `link_type` hold them; of b"", those of an error frame."""
        return data

    def shown(self, medium: str, nodes: Sequence[str]) -> list[Shown]:
        """Return tables of bounds and load, computed before the run, for the medium `medium` between `nodes`."""
        return []

    def reports_own_frames_to(self, node: str) -> bool:
        """Return whether `node` receives its own frames once they got through."""
        return False

    def notifies(self, node: str) -> bool:
        """Return whether the interface of `node` to the medium tells it how each frame went that it sent."""
        return False

    def links_to_themselves(self) -> Collection[str]:
        """Return the nodes with a link to themselves."""
        return ()

    def recorders(self, medium: str) -> Mapping[str, object]:
        """Return the settings of the recorders that the medium `medium` requests, by kind of recorder."""
        return {}

    def poses(self) -> Mapping[str, ShownPose]:
        """Return, by node, the outputs of its plant that the medium reads; errors in them name `poses_key`."""
        return {}

    def standing(self, nodes: Sequence[str]) -> Collection[str]:
        """Return the nodes that the medium takes to stand at a constant position, from which it computes links."""
        return ()

    def located(self, at_m: Mapping[str, Sequence[float] | None]) -> Collection[str]:
        """Return the nodes whose position the medium knows during the run; `at_m` has its nodes, None: no position."""
        return ()

    def camera(self, observer: str) -> Camera | None:
        """Return the camera by which `observer` sees the nodes of `poses`; None if it has none."""
        return None

    def floor_plan(self) -> FloorPlan | None:
        """Return the data for a view of the medium from above; None if there is nothing to draw."""
        return None

    def longest_frame_bytes(self) -> int | None:
        """Return the length of the longest frame that the medium takes; None: it has no limit."""
        return None

    def weak_areas(self) -> Sequence[WeakArea]:
        """Return the areas on the ground that weaken links."""
        return ()

    def radio(self) -> RadioPreset | None:
        """Return the radio that sends and receives the frames; None if the medium is no radio channel."""
        return None

    def datagram_format(self) -> DatagramFormat | None:
        """Return how a port takes datagrams of any bytes; None if it takes none."""
        return None

    def serial_format(self) -> SerialFormat | None:
        """Return timing and chunks of a medium that carries single bytes in order; None if it carries frames."""
        return None
