"""Time-triggered activation at offset, offset + period, ...; the k-th instant comes from k, so it cannot drift.

Not modelled: release jitter.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Periodic:
    period_ns: int
    offset_ns: int = 0

    def __post_init__(self) -> None:
        if self.period_ns < 1:
            raise ValueError(f"period_ns={self.period_ns}: expected at least 1")
        if not 0 <= self.offset_ns < self.period_ns:
            raise ValueError(f"offset_ns={self.offset_ns}: expected 0 <= offset < period ({self.period_ns} ns)")

    def check_execution(self, execution_ns: int) -> None:
        """Raise ValueError if a task of `execution_ns` does not end before its next activation."""
        if not 0 <= execution_ns < self.period_ns:
            raise ValueError(f"execution_ns={execution_ns}: expected 0 <= execution < period ({self.period_ns} ns), or "
                             "the loop never keeps up; lengthen the period")

    def next_after(self, now_ns: int) -> int:
        """First activation strictly after `now_ns`."""
        k = max(0, (now_ns - self.offset_ns) // self.period_ns + 1)
        return self.offset_ns + k * self.period_ns
