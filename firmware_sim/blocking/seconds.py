"""Durations as `time.sleep` and python-can take them, float seconds, in whole nanoseconds."""

from __future__ import annotations

from math import isfinite


def duration_ns(seconds: float) -> int:
    """To the nearest nanosecond, but at least one if any time is to pass: a wait for what is left must end."""
    if not isfinite(seconds) or seconds < 0:
        raise ValueError(f"{seconds} s: expected a finite number of seconds, 0 or more")
    return max(1, round(seconds * 1e9)) if seconds else 0
