"""Converts durations in float seconds, as `time.sleep` and python-can take them, to whole nanoseconds."""

from __future__ import annotations

from math import isfinite


def duration_ns(seconds: float) -> int:
    """Round to nanoseconds, a positive number to at least 1, so that a loop of waits ends; ValueError below 0."""
    if not isfinite(seconds) or seconds < 0:
        raise ValueError(f"{seconds} s: expected a finite number of seconds, 0 or more")
    return max(1, round(seconds * 1e9)) if seconds else 0
