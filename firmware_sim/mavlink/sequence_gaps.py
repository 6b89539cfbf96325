"""Counts the lost frames of each source by their sequence numbers (modulo 256).

    number = expected            in order
    up to 127 ahead              that many frames are missing
    behind, or the same          late or repeated; if the next frame follows it, the source has restarted

A loss of 128 frames or more is counted wrongly, since the numbers have only 8 bits.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class Source:
    last: int
    stray: int = -1             # the last late number, by which a restart is detected


@dataclass
class SequenceGaps:
    sources: dict[tuple[int, int], Source] = field(default_factory=dict)

    def heard(self, system: int, component: int, sequence: int) -> int:
        """Note a frame; return how many frames are missing before it."""
        source = self.sources.get((system, component))
        if source is None:
            self.sources[system, component] = Source(sequence)
            return 0
        ahead = (sequence - source.last - 1) % 256
        if ahead < 128:
            source.last, source.stray = sequence, -1
            return ahead
        if sequence == (source.stray + 1) % 256 and source.stray >= 0:
            source.last, source.stray = sequence, -1
        else:
            source.stray = sequence
        return 0
