"""Checks of an impairment's settings at construction: each raises ValueError with the value and the rule.

The scenario loader adds the place.
"""

from __future__ import annotations


def expect_ratio(name: str, value: float) -> None:
    if not 0 <= value <= 1:
        raise ValueError(f"{name}={value}: expected 0 <= {name} <= 1")


def expect_ratio_below_one(name: str, value: float) -> None:
    if not 0 <= value < 1:
        raise ValueError(f"{name}={value}: expected 0 <= {name} < 1")


def expect_correlation(value: float) -> None:
    if not -1 < value < 1:
        raise ValueError(f"correlation={value}: expected -1 < correlation < 1")


def expect_at_least(name: str, value: int, least: int) -> None:
    if value < least:
        raise ValueError(f"{name}={value}: expected {name} >= {least}")
