"""Decode rules: which of several overlapping frames a receiver can decode.

A member of this kind has one verb, `fate`. The medium calls it at the end of each frame that others overlapped.
"""

from __future__ import annotations

from typing import Protocol

from netem.core.fate import Fate
from netem.media.decoding.on_air import OnAir


class Decoding(Protocol):
    overlaps_matter: bool
    overlap_loses_both: bool        # whatever their power, wherever both are in range

    def fate(self, wanted: OnAir, receiver: str) -> Fate | None:
        """Fate of `wanted` at `receiver`, which is in range, if it cannot decode the frame; None if it can."""
