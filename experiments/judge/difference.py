"""Whether two campaigns differ by more than chance, and how the figures of two runs differ.

Runs of equal setting and seed are compared as pairs, if both campaigns have the same ones; else as two samples.

    verdicts   pairs: exact test of McNemar (1947), which is binomial on the runs that hold in one campaign only;
               else the exact test of Fisher (1922)
    figures    permutation test of the difference of means (Pitman 1937): of the signs of the differences of pairs, or
               of the labels of the runs

All tests are two-sided. The p-values of one comparison are adjusted by Holm (1979): the chance that one of them is at
most `LEVEL`, if no figure differs at all, is at most `LEVEL`.

Not modelled: what a difference means. A figure that differs by little is told all the same, if there are enough runs.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite, nan
from typing import Any, Final

import msgspec
import numpy as np

from experiments.judge.campaign import Campaign, Row
from experiments.judge.campaign_statistics import Estimate, mean, share

LEVEL: Final = 0.05
RESAMPLES: Final = 9_999                # permutations that are drawn, where there are more than these
MOST_AT_ONCE: Final = 2_000_000
HOLDS: Final = "runs that hold"


@dataclass(frozen=True)
class Difference:
    """One figure of two campaigns. `p` is adjusted; nan if nothing can be tested. `missing` counts runs without it."""

    key: str
    a: Estimate | None
    b: Estimate | None
    p: float
    test: str
    missing: int = 0

    @property
    def differs(self) -> bool:
        return self.p <= LEVEL

    def in_words(self) -> str:
        if not isfinite(self.p):
            return "nothing to compare"
        return "differs" if self.differs else "no more than chance"


def differences(a: Campaign, b: Campaign) -> list[Difference]:
    """Return a difference for the verdicts, and for each figure that both campaigns have."""
    pairs = _pairs(a, b)
    found = [_verdicts(a, b, pairs)]
    found += [_figure(key, a, b, pairs) for key in a.keys if key in b.keys]
    return [replace(one, p=p) for one, p in zip(found, holm([one.p for one in found]), strict=True)]


def holm(p_values: Sequence[float]) -> list[float]:
    """Return the p-values adjusted by Holm (1979), in the order given; nan stays nan and counts as no test."""
    order = sorted((k for k, p in enumerate(p_values) if isfinite(p)), key=lambda k: p_values[k])
    adjusted = [nan] * len(p_values)
    largest = 0.0
    for rank, k in enumerate(order):
        largest = max(largest, min(1.0, (len(order) - rank) * p_values[k]))
        adjusted[k] = largest
    return adjusted


def _pairs(a: Campaign, b: Campaign) -> list[tuple[Row, Row]]:
    """Return the runs of equal setting and seed; none unless all runs of both campaigns have their counterpart."""
    def by_place(campaign: Campaign) -> dict[tuple[bytes, int], Row]:
        return {(_bytes(campaign.plan.settings[row.setting]), row.seed): row for row in campaign.rows}

    of_a, of_b = by_place(a), by_place(b)
    return [(row, of_b[place]) for place, row in of_a.items()] if of_a.keys() == of_b.keys() else []


def _bytes(setting: dict[str, Any]) -> bytes:
    return msgspec.json.encode(dict(sorted(setting.items())))


def _verdicts(a: Campaign, b: Campaign, pairs: Sequence[tuple[Row, Row]]) -> Difference:
    from scipy.stats import binomtest, fisher_exact

    held = [sum(row.figures.holds for row in campaign.rows) for campaign in (a, b)]
    of_a, of_b = (share(count, len(campaign.rows)) if campaign.rows else None
                  for count, campaign in zip(held, (a, b), strict=True))
    if not a.rows or not b.rows:
        return Difference(HOLDS, of_a, of_b, nan, "none")
    if pairs:
        only_a = sum(one.figures.holds and not other.figures.holds for one, other in pairs)
        only_b = sum(other.figures.holds and not one.figures.holds for one, other in pairs)
        p = float(binomtest(only_a, only_a + only_b).pvalue) if only_a + only_b else 1.0
        return Difference(HOLDS, of_a, of_b, p, "McNemar, pairs")
    table = np.array([[count, len(campaign.rows) - count] for count, campaign in zip(held, (a, b), strict=True)])
    return Difference(HOLDS, of_a, of_b, float(fisher_exact(table).pvalue), "Fisher")


def _figure(key: str, a: Campaign, b: Campaign, pairs: Sequence[tuple[Row, Row]]) -> Difference:
    values_a, values_b = a.values(key), b.values(key)
    estimates = mean(values_a), mean(values_b)
    missing = len(a.rows) + len(b.rows) - len(values_a) - len(values_b)
    if pairs:
        both = [(one.figures.values.get(key), other.figures.values.get(key)) for one, other in pairs]
        gaps = [y - x for x, y in both if x is not None and y is not None and isfinite(x) and isfinite(y)]
        return Difference(key, *estimates, _paired(gaps), "permutation, pairs", missing)
    finite_a, finite_b = ([value for value in values if isfinite(value)] for values in (values_a, values_b))
    return Difference(key, *estimates, _independent(finite_a, finite_b), "permutation", missing)


def _paired(gaps: Sequence[float]) -> float:
    """Return the p-value of the mean of `gaps` against 0."""
    if not gaps:
        return nan
    if not any(gaps):
        return 1.0
    return _permuted((np.array(gaps),), lambda x, axis: np.mean(x, axis=axis), "samples")


def _independent(a: Sequence[float], b: Sequence[float]) -> float:
    if len(a) < 2 or len(b) < 2:
        return nan
    if len({*a, *b}) == 1:
        return 1.0
    return _permuted((np.array(a), np.array(b)), lambda x, y, axis: np.mean(x, axis=axis) - np.mean(y, axis=axis),
                     "independent")


def _permuted(samples: tuple[np.ndarray[Any, Any], ...], statistic: Any, kind: Any) -> float:
    from scipy.stats import permutation_test

    size = sum(sample.size for sample in samples)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)     # overflow in figures that diverge
        found = permutation_test(samples, statistic, permutation_type=kind, n_resamples=RESAMPLES, vectorized=True,
                                 batch=max(1, MOST_AT_ONCE // size), rng=np.random.default_rng(0))
    return float(found.pvalue)
