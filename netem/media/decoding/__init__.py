"""Decoding: what a receiver makes of frames that overlap.

A member of this kind has one verb, `fate`. It is asked at the end of a frame, if something was on the
air with it.
"""

from __future__ import annotations

from typing import Protocol

from netem.core.fate import Fate
from netem.media.decoding.on_air import OnAir


class Decoding(Protocol):
    overlaps_matter: bool
    overlap_loses_both: bool        # whatever their power, wherever both are in range

    def fate(self, wanted: OnAir, receiver: str) -> Fate | None:
        """Why `receiver`, who is in range, does not get `wanted`; None if it does."""
