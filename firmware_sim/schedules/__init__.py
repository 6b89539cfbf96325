"""Schedules: when a firmware task or a transmission is due, on the local clock.

A member of this kind has one verb, `next_after`. It is a pure function of the local time, strictly increasing from
instant to instant, and the k-th instant is computed from k, so it cannot drift. A clock that is set back gets the
same instants again.
"""

from __future__ import annotations

from typing import Protocol


class Schedule(Protocol):
    def next_after(self, now_ns: int) -> int:
        """First instant strictly after `now_ns`."""
        ...
