"""The local model: media access is abstracted away. Everybody in range gets every frame.

No collisions and no deafness: a node hears while it transmits. Airtime, range and the MAC stay as they are.
Source: the dissertation, subsection 1.2.5.
"""

from __future__ import annotations

from netem.core.fate import Fate
from netem.media.decoding.on_air import OnAir


class Local:
    overlaps_matter = False
    overlap_loses_both = False

    def fate(self, wanted: OnAir, receiver: str) -> Fate | None:
        return None
