"""Estimates from the runs of a campaign, each with a two-sided interval of confidence `CONFIDENCE`.

    share of runs that hold   k/n, exact interval of Clopper and Pearson (1934): it covers the true share with at least
                              the confidence stated, whatever n
    mean of a figure          bias-corrected and accelerated bootstrap (Efron 1987) over the runs

Not modelled: dependence between runs. Seeds are independent of each other; the settings of a grid are not a sample, so
an interval over all settings is about these settings only.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Final

import numpy as np

CONFIDENCE: Final = 0.95
RESAMPLES: Final = 2000
MOST_AT_ONCE: Final = 2_000_000             # resampled numbers that are in memory at a time


@dataclass(frozen=True)
class Estimate:
    """`low` and `high` are None if the runs give no interval: fewer than two of them, or values that are not finite."""

    value: float
    low: float | None
    high: float | None
    runs: int


def share(held: int, runs: int) -> Estimate:
    """Estimate the share of runs that hold, from `held` of `runs`, at least one."""
    from scipy.stats import binomtest

    interval = binomtest(held, runs).proportion_ci(CONFIDENCE, method="exact")
    return Estimate(held / runs, float(interval.low), float(interval.high), runs)


def mean(values: Sequence[float]) -> Estimate | None:
    """Estimate the mean of a figure; None without values. The same values give the same interval."""
    if not values:
        return None
    numbers = np.asarray(values, dtype=np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        found = float(numbers.mean())
    if numbers.size < 2 or not isfinite(found):
        return Estimate(found, None, None, numbers.size)
    if float(numbers.min()) == float(numbers.max()):
        return Estimate(found, found, found, numbers.size)
    from scipy.stats import bootstrap

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")             # of runs that are all alike but one: the interval is nan then
        interval = bootstrap((numbers,), np.mean, confidence_level=CONFIDENCE, n_resamples=RESAMPLES, method="BCa",
                             batch=max(1, MOST_AT_ONCE // numbers.size), rng=np.random.default_rng(0)
                             ).confidence_interval
    low, high = float(interval.low), float(interval.high)
    if not (isfinite(low) and isfinite(high)):
        return Estimate(found, None, None, numbers.size)
    return Estimate(found, low, high, numbers.size)
