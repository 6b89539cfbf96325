"""Intervals [low, high] of allowed start values, as a model's table declares them; None is an open end."""

from __future__ import annotations


def outside(value: float, low: float | None, high: float | None) -> str:
    """Return the broken rule (`expected 0 to 1`) if `value` lies outside [low, high], otherwise ""."""
    if (low is None or value >= low) and (high is None or value <= high):
        return ""
    return f"expected {interval(low, high)}"


def interval(low: float | None, high: float | None) -> str:
    """Return [low, high], of which at least one end is closed, in words: `0 to 1`, `at least 0`, `at most 1`."""
    if low is not None and high is not None:
        return f"{low:g} to {high:g}"
    return f"at least {low:g}" if low is not None else f"at most {high:g}"
