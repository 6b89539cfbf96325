"""Lateness of the events of a run in real time, in a histogram whose size does not depend on the run's length.

    bucket of t: [lower, lower + width)    width <= lower / 32, and 1 ns below 32 ns

A quantile is given as the upper bound of its bucket, so it is too large by less than 1/32 of itself.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any, Final

OVERRUN_NS: Final = 10_000_000      # a larger lateness is an overrun, unless the scenario says otherwise
_BITS: Final = 5                    # bits kept of a lateness beyond its leading one


@dataclass
class Lateness:
    """Collects the lateness of events of one kind: the time from when they are due to when they happen [ns]."""

    events: int = 0
    worst_ns: int = 0
    buckets: Counter[int] = field(default_factory=Counter)      # events by the upper bound of their bucket [ns]

    def add(self, late_ns: int) -> None:
        """Count one event. Raises ValueError if it happened early."""
        if late_ns < 0:
            raise ValueError(f"late_ns={late_ns}: an event of a run in real time never happens early")
        self.events += 1
        self.worst_ns = max(self.worst_ns, late_ns)
        shift = max(0, late_ns.bit_length() - 1 - _BITS)
        self.buckets[((late_ns >> shift) + 1 << shift) - 1] += 1

    def quantile_ns(self, ratio: float) -> int:
        """Return the lateness [ns] that at least `ratio` of the events do not exceed; 0 without events."""
        if not 0 <= ratio <= 1:
            raise ValueError(f"ratio={ratio}: expected 0 <= ratio <= 1")
        wanted, seen = ratio * self.events, 0
        for upper_ns in sorted(self.buckets):
            seen += self.buckets[upper_ns]
            if seen >= wanted:
                return min(upper_ns, self.worst_ns)
        return self.worst_ns

    def figures(self) -> dict[str, Any]:
        """Return the entries of `run.json`: quantiles of lateness [ns], and the histogram.

        The histogram has a pair (largest lateness of the bucket [ns], events in it) for each bucket that is not empty.
        """
        return {**self.quantiles(), "histogram": sorted(self.buckets.items())}

    def quantiles(self) -> dict[str, int]:
        return {"median_ns": self.quantile_ns(0.5), "p99_ns": self.quantile_ns(0.99), "worst_ns": self.worst_ns}
