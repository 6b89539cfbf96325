"""An interval in which a node does not take what arrives: it is dead, or it stands still behind a full buffer.

The ledger asks, as it settles a copy that arrived within the interval, whether the copy got through after all.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections import Counter

from netem.core.fate import Fate


class Absence:
    """A dead node, from `from_ns` on and before `until_ns` [ns], by `cause`: nothing gets through."""

    def __init__(self, from_ns: int, until_ns: int, cause: str = "") -> None:
        self.from_ns, self.until_ns, self.cause = from_ns, until_ns, cause

    def fate(self, medium: str, arrival_ns: int) -> Fate | None:
        """Return the fate of the next copy that arrives on `medium` at this instant, None if it got through.

        The ledger asks once for each copy; copies of one instant in the order in which they were delivered.
        """
        return Fate.RECEIVER_GONE


class Pause(Absence):
    """A node that stands still: of each medium, the first `depth` copies to arrive wait in its receive buffer."""

    def __init__(self, from_ns: int, until_ns: int, depth: int, cause: str = "") -> None:
        super().__init__(from_ns, until_ns, cause)
        self.depth = depth
        self._arrivals: dict[str, list[int]] = {}       # by medium, in order
        self._asked: Counter[tuple[str, int]] = Counter()

    def arrives(self, medium: str, arrival_ns: int) -> None:
        """Note a copy that is delivered within the interval; the emulator calls this before its arrival has passed."""
        insort(self._arrivals.setdefault(medium, []), arrival_ns)

    def fate(self, medium: str, arrival_ns: int) -> Fate | None:
        earlier = bisect_left(self._arrivals[medium], arrival_ns) + self._asked[medium, arrival_ns]
        self._asked[medium, arrival_ns] += 1
        return None if earlier < self.depth else Fate.RECEIVER_PAUSED
