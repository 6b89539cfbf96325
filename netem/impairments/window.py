"""A time window: an impairment acts only on copies that enter the link during one of the intervals [start, end).

The impairment does not lose, change or duplicate a copy that enters outside, and draws no random number for it. The
copy leaves at the instant at which it entered, unless copies from inside are still on their way and the impairment
keeps order: its `carry_outside` then delays the copy until it overtakes none of them.

    rate_limit            the queue drains at its rate; later copies come out after its last one, at once
    delay, keep_order     later copies come out after the last delayed one
    reorder               later copies come out after the last held one
    all others            keep no order: later copies pass at once and overtake those still delayed

Invariants: intervals are half open, do not overlap, and are kept sorted.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment


class Window:
    """`during_ns` is one (start, end) pair or a list of pairs, in ns of run time, compared with `transit.sent_ns`."""

    def __init__(self, impairment: Impairment, during_ns: Sequence[Sequence[int]] | Sequence[int]) -> None:
        self.impairment = impairment
        self.loses_as: Fate = impairment.loses_as
        self.during_ns = _checked(during_ns)
        self._outside: Callable[[Transit], Transit] = getattr(impairment, "carry_outside", unchanged)
        self._edges_ns = [edge for interval in self.during_ns for edge in interval]

    def carry(self, transit: Transit) -> Iterable[Transit]:
        inside = bisect_right(self._edges_ns, transit.sent_ns) & 1      # an odd number of edges lies behind
        return self.impairment.carry(transit) if inside else (self._outside(transit),)


def unchanged(transit: Transit) -> Transit:
    return transit


def _checked(during_ns: Sequence[Sequence[int]] | Sequence[int]) -> list[tuple[int, int]]:
    if not during_ns:
        raise ValueError("during_ns=[]: expected at least one interval [start, end)")
    pairs = [during_ns] if isinstance(during_ns[0], int) else during_ns
    intervals = []
    for pair in pairs:
        match pair:
            case [int(start), int(end)] if 0 <= start < end:
                intervals.append((start, end))
            case _:
                raise ValueError(f"during_ns={pair}: expected [start, end) with 0 <= start < end")
    intervals.sort()
    for first, second in pairwise(intervals):
        if second[0] < first[1]:
            raise ValueError(f"during_ns={[first, second]}: intervals overlap: merge them")
    return intervals
