"""Decoding: what a receiver makes of frames that overlap.

A member of this kind has one verb, `fate`. It is asked at the end of a frame, if something was on the
air with it.
"""

from __future__ import annotations

from typing import Protocol

import msgspec

from netem.frames import Fate, Frame
from netem.topology import Reach


class OnAir(msgspec.Struct, eq=False):
    """One transmission of `sender`, on [start_ns, end_ns). `rivals` are those that overlapped it so far."""

    sender: str
    frame: Frame
    reach: Reach
    start_ns: int
    end_ns: int
    rivals: list[OnAir] = []


class Decoding(Protocol):
    overlaps_matter: bool

    def fate(self, wanted: OnAir, receiver: str) -> Fate | None:
        """Why `receiver`, who is in range, does not get `wanted`; None if it does."""
