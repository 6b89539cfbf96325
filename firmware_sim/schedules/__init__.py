"""Schedules: the instants of a firmware task or a transmission on the local clock.

A member of this kind has one verb, `next_after`, a pure function of the local time. The instants increase strictly, and
the k-th one is computed from k, so it does not drift. If the clock is set back, the same instants occur again.
"""

from __future__ import annotations

from typing import Protocol


class Schedule(Protocol):
    def next_after(self, now_ns: int) -> int:
        """First instant strictly after `now_ns`."""
