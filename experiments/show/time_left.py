"""Estimates the time that is left of some work from the pace of the work so far.

    left = work to come / pace        pace = work done since the mark / time since the mark

The mark is the first call, or the first one after `forget`, so that neither the start of processes nor a pause counts.
"""

from __future__ import annotations


class TimeLeft:
    """Estimates the time left of `total` units of work, from when `least` of them have been done since the mark on."""

    def __init__(self, total: float, least: float) -> None:
        self._total, self._least = total, least
        self._mark: tuple[float, float] | None = None           # work done, and when [s]

    def at(self, done: float, now_s: float) -> str:
        """Return the time left in words; "" at the end and while it is not known."""
        if self._mark is None:
            self._mark = done, now_s
        marked, mark_s = self._mark
        if done - marked < self._least or done >= self._total:
            return ""
        return f"{_duration((now_s - mark_s) * (self._total - done) / (done - marked))} left"

    def forget(self) -> None:
        """Measure the pace anew: the work is held, or was."""
        self._mark = None


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min {rest} s" if minutes else \
        f"{rest} s"
