"""The radio network model: a receiver loses both of two in-range frames that overlap, and no node detects it.

A receiver that transmits during any part of a frame is deaf to it.
Source: the dissertation, subsection 1.2.5, after Schneider and Wattenhofer 2009.
Not modelled: power; the frames of a node out of range do not interfere.
"""

from __future__ import annotations

from netem.core.fate import Fate
from netem.media.decoding.on_air import OnAir


class RadioNetwork:
    overlaps_matter = True
    overlap_loses_both = True

    def fate(self, wanted: OnAir, receiver: str) -> Fate | None:
        collided = False
        for rival in wanted.rivals:
            if rival.sender == receiver:
                return Fate.DEAF
            collided = collided or receiver in rival.reach.in_range
        return Fate.COLLIDED if collided else None
