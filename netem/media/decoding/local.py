"""The local model, which abstracts from media access: every receiver in range decodes every frame.

There are no collisions and no deafness: a node receives while it transmits. Airtime, range and the MAC still apply.
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
