"""When a fault occurs: at an instant or in windows, once, repeated, or at random.

    at_s = 4.0                                      once
    at_s = 4.0, every_s = 2.0, times = 3            at 4, 6 and 8 s; without `times`, to the end of the run
    during_s = [6.0, 8.0]                           a window, or a list of windows; `every_s` repeats the first of one
    at_s = 6.0, lasts_s = 2.0                       the same
    rate_per_s = 0.1, lasts_s = 2.0                 a Poisson process: gaps are exponential with mean 1 / rate

Random instants come from the fault's own stream, so another fault never changes them. All are known before the run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log1p
from random import Random
from typing import Any, NamedTuple

from netem.wire.instants import NEVER_NS


class Occurrence(NamedTuple):
    """One occurrence in [start_ns, end_ns); `end_ns` is `start_ns` for an instant, NEVER_NS for the end of the run."""

    start_ns: int
    end_ns: int


@dataclass(frozen=True)
class Schedule:
    """Times in ns; ValueError, with the key first, for keys that contradict each other."""

    at_ns: int | None = None
    during_ns: tuple[tuple[int, int], ...] = ()
    lasts_ns: int | None = None
    every_ns: int | None = None
    times: int | None = None
    rate_per_s: float | None = None

    def __post_init__(self) -> None:
        ways = [key for key, given in (("at_s", self.at_ns is not None), ("during_s", bool(self.during_ns)),
                                       ("rate_per_s", self.rate_per_s is not None)) if given]
        if len(ways) != 1:
            given = f"{' and '.join(ways)} are" if ways else "none of at_s, during_s and rate_per_s is"
            raise ValueError(f"{given} given: a fault has exactly one of them, which says when it occurs")
        for key in ("lasts_ns", "every_ns"):
            value = getattr(self, key)
            if value is not None and value < 1:
                raise ValueError(f"{key}={value}: expected more than 0")
        if self.at_ns is not None and self.at_ns < 0:
            raise ValueError(f"at_ns={self.at_ns}: expected 0 or more")
        for start_ns, end_ns in self.during_ns:
            if not 0 <= start_ns < end_ns:
                raise ValueError(f"during_ns=[{start_ns}, {end_ns}]: expected 0 <= start < end")
        if self.during_ns and self.lasts_ns is not None:
            raise ValueError(f"lasts_ns={self.lasts_ns}: during_s says already how long it lasts")
        if self.rate_per_s is not None and not self.rate_per_s > 0:
            raise ValueError(f"rate_per_s={self.rate_per_s}: expected more than 0")
        if self.every_ns is not None and (self.rate_per_s is not None or len(self.during_ns) > 1):
            raise ValueError(f"every_ns={self.every_ns}: repeats at_s or one window of during_s")
        if self.times is not None and (self.times < 1 or self.every_ns is None):
            raise ValueError(f"times={self.times}: expected at least 1, with every_s")

    def occurrences(self, length_ns: int, rng: Random, *, lasting: bool) -> list[Occurrence]:
        """Return the occurrences in a run of this length, in order of their starts.

        `lasting` says whether the fault has an end. ValueError, with the key first, if it has none and an end is given,
        or if an instant lies outside the run.
        """
        if not lasting and (self.during_ns or self.lasts_ns is not None):
            key = "during_ns" if self.during_ns else "lasts_ns"
            raise ValueError(f"{key}={getattr(self, key)}: this fault happens at an instant: give at_s or rate_per_s")
        if self.rate_per_s is not None:
            return self._drawn(length_ns, rng, lasting)
        windows = list(self.during_ns) or [(self.at_ns or 0, self._end_ns(self.at_ns or 0, lasting))]
        for start_ns, _ in windows:
            if start_ns >= length_ns:
                key = "during_ns" if self.during_ns else "at_ns"
                raise ValueError(f"{key}={start_ns}: is not before the end of the run at {length_ns / 1e9:g} s")
        if self.every_ns is None:
            return [Occurrence(*window) for window in sorted(windows)]
        (start_ns, end_ns), = windows
        if lasting and end_ns - start_ns > self.every_ns:
            raise ValueError(f"every_ns={self.every_ns}: is shorter than one occurrence lasts, so they would overlap")
        most = NEVER_NS if self.times is None else self.times
        last = min(most, -(-(length_ns - start_ns) // self.every_ns))
        return [Occurrence(start_ns + k * self.every_ns, min(end_ns + k * self.every_ns, NEVER_NS))
                for k in range(last)]

    def _end_ns(self, start_ns: int, lasting: bool) -> int:
        if not lasting:
            return start_ns
        return NEVER_NS if self.lasts_ns is None else start_ns + self.lasts_ns

    def _drawn(self, length_ns: int, rng: Random, lasting: bool) -> list[Occurrence]:
        assert self.rate_per_s is not None
        if lasting and self.lasts_ns is None:
            raise ValueError("lasts_s is missing: a fault that lasts and occurs at random times needs it")
        found: list[Occurrence] = []
        now_ns = 0
        while True:
            now_ns += round(-log1p(-rng.random()) / self.rate_per_s * 1e9)
            if now_ns >= length_ns:
                return found
            found.append(Occurrence(now_ns, self._end_ns(now_ns, lasting)))


def windows_of(during_ns: Sequence[Any]) -> tuple[tuple[int, int], ...] | None:
    """Return [start, end], or a list of such windows, as pairs; None for another form."""
    pairs = [during_ns] if during_ns and isinstance(during_ns[0], int) else during_ns
    found = []
    for pair in pairs:
        if not isinstance(pair, list | tuple) or len(pair) != 2 or not all(isinstance(edge, int) for edge in pair):
            return None
        found.append((pair[0], pair[1]))
    return tuple(found)
