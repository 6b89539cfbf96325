"""One transmission on a radio channel, with the frames that overlap it."""

from __future__ import annotations

from netem.core.frame import Frame
from netem.topology.reach import Reach


class OnAir:
    """A frame of `sender`, on the air during [start_ns, end_ns). `rivals` are the frames that overlapped it so far."""

    __slots__ = ("end_ns", "frame", "reach", "rivals", "sender", "start_ns")

    def __init__(self, sender: str, frame: Frame, reach: Reach, start_ns: int, end_ns: int) -> None:
        self.sender = sender
        self.frame = frame
        self.reach = reach
        self.start_ns = start_ns
        self.end_ns = end_ns
        self.rivals: list[OnAir] = []
