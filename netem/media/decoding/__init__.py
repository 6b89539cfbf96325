"""Decoding: what a receiver makes of frames that overlap.

A member of this kind has one verb, `fate`. It is asked at the end of a frame, if something was on the
air with it.
"""

from __future__ import annotations

from typing import Protocol

from netem.frames import Fate, Frame
from netem.topology import Reach


class OnAir:
    """One transmission, on [start_ns, end_ns). `rivals` are those that overlapped it so far."""

    __slots__ = ("end_ns", "frame", "reach", "rivals", "sender", "start_ns")

    def __init__(self, frame: Frame, reach: Reach, start_ns: int, end_ns: int) -> None:
        self.frame = frame
        self.sender = frame.sender
        self.reach = reach
        self.start_ns = start_ns
        self.end_ns = end_ns
        self.rivals: list[OnAir] = []


class Decoding(Protocol):
    overlaps_matter: bool

    def fate(self, wanted: OnAir, receiver: str) -> Fate | None:
        """Why `receiver`, who is in range, does not get `wanted`; None if it does."""
