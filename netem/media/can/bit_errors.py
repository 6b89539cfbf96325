"""Chooses the bits of the bus that are inverted: independently at random, or by a script. All nodes see the same bits.

    P(no bit of n is inverted) = (1 - ratio)^n        first one: floor(ln(1 - u) / ln(1 - ratio)), one draw a frame

Only the first inverted bit of a frame matters, as an error frame follows. `ratio` applies to transmissions that start
within `during_ns`. A script names the number of a transmission on the bus, counted from 0 with repetitions, and a bit
of it, counted from SOF = 0, or backwards from -1, the last bit of the end of frame.

Not modelled: bursts; hits between frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log1p
from random import Random

Window = tuple[int, int]            # [start_ns, end_ns)


@dataclass(frozen=True)
class ScriptedBit:
    transmission: int
    bit: int

    def __post_init__(self) -> None:
        if self.transmission < 0:
            raise ValueError(f"transmission={self.transmission}: transmissions are counted from 0")


@dataclass(frozen=True)
class BitErrorSettings:
    ratio: float = 0.0                                  # share of inverted bits
    during_ns: tuple[Window, ...] | Window = ()         # one window or several; (): the whole run
    scripted: tuple[ScriptedBit, ...] = ()

    def __post_init__(self) -> None:
        if not 0 <= self.ratio < 1:
            raise ValueError(f"ratio={self.ratio}: expected 0 <= ratio < 1")
        for start_ns, end_ns in self.windows_ns:
            if not 0 <= start_ns < end_ns:
                raise ValueError(f"during_ns={[start_ns, end_ns]}: expected 0 <= start < end")
        if len({hit.transmission for hit in self.scripted}) < len(self.scripted):
            raise ValueError("scripted: two bits of one transmission; the first one ends it, keep that")

    @property
    def windows_ns(self) -> tuple[Window, ...]:
        several = (entry for entry in self.during_ns if isinstance(entry, tuple))
        edges = [entry for entry in self.during_ns if isinstance(entry, int)]
        return (*several, *zip(edges[::2], edges[1::2], strict=True))


class BitErrors:
    def __init__(self, settings: BitErrorSettings, rng: Random) -> None:
        self._per_bit = log1p(-settings.ratio)
        self._during_ns: Sequence[tuple[int, int]] = settings.windows_ns
        self._scripted = {hit.transmission: hit.bit for hit in settings.scripted}
        self._rng = rng
        self.possible = bool(settings.ratio or settings.scripted)

    def first_hit(self, transmission: int, start_ns: int, bits: int) -> int | None:
        """Return the index of the first inverted bit of a frame of `bits` bits, SOF = 0; None if there is none."""
        hits = []
        scripted = self._scripted.get(transmission)
        if scripted is not None and -bits <= scripted < bits:
            hits.append(scripted % bits)
        if self._per_bit and self._within(start_ns):
            by_chance = log1p(-self._rng.random()) / self._per_bit
            if by_chance < bits:
                hits.append(int(by_chance))
        return min(hits, default=None)

    def _within(self, time_ns: int) -> bool:
        return not self._during_ns or any(start_ns <= time_ns < end_ns for start_ns, end_ns in self._during_ns)
