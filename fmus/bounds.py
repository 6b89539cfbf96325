"""The interval that a variable's table allows for its start value, both ends included; None is an open end."""

from __future__ import annotations


def outside(value: float, low: float | None, high: float | None) -> str:
    """What is wrong with `value`, "" if it lies in [low, high]."""
    if (low is None or value >= low) and (high is None or value <= high):
        return ""
    return f"expected {interval(low, high)}"


def interval(low: float | None, high: float | None) -> str:
    """In words: `0 to 1`, `at least 0`, `at most 1`."""
    if low is not None and high is not None:
        return f"{low:g} to {high:g}"
    return f"at least {low:g}" if low is not None else f"at most {high:g}"
