"""How many runs of a campaign keep each bound of `[expect]`, and whether that shows the share that a bound asks for.

    rate        k of the n runs of one setting keep the bound, with the exact interval of `campaign_statistics.share`
    a share p   is shown if the interval begins at p or above, refuted if it ends below p, and else undecided

A run that failed keeps no bound. If all n runs keep one, the interval begins at (alpha / 2)^(1/n), alpha = 1 -
`CONFIDENCE`: a share p needs n >= log(alpha / 2) / log(p) runs, 0.9 for instance 36.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from math import ceil, log

from experiments.judge.campaign import Campaign
from experiments.judge.campaign_statistics import CONFIDENCE, Estimate, share


class Showing(Enum):
    SHOWN = "shown"
    REFUTED = "refuted"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Rate:
    setting: int
    key: str
    kept: int                   # runs of the setting that keep the bound
    estimate: Estimate          # of the share of such runs
    share: float | None         # expected at least; None: every run has to keep it

    @property
    def runs(self) -> int:
        return self.estimate.runs

    @property
    def showing(self) -> Showing | None:
        """Whether the runs show or refute the expected share; None if every run is expected to keep the bound."""
        low, high = self.estimate.low, self.estimate.high
        if self.share is None or low is None or high is None:       # an exact interval has both ends
            return None
        return Showing.SHOWN if low >= self.share else Showing.REFUTED if high < self.share else Showing.UNDECIDED

    def in_words(self) -> str:
        """Return the expected share, the verdict and how many runs decide, for the table; "" without a share."""
        if self.share is None or self.showing is None:
            return ""
        asked = f"at least {100 * self.share:.4g} %: {self.showing.value}"
        if self.showing is not Showing.UNDECIDED:
            return asked
        least = fewest_runs(self.share)
        return asked + (f", which takes {least} runs or more" if self.runs < least else ", more seeds decide")


def fewest_runs(share: float) -> int:
    """Return how many runs show a share of 0 < share < 1 if all of them keep the bound."""
    return ceil(log((1 - CONFIDENCE) / 2) / log(share))


def rates(campaign: Campaign) -> Iterator[Rate]:
    """Yield the rates by setting, then in the order of `[expect]`; none for a setting of which no run has ended."""
    for setting in range(len(campaign.plan.settings)):
        rows = campaign.of_setting(setting)
        for key, bound in campaign.plan.bounds.items() if rows else ():
            kept = sum(not row.figures.failure and key not in row.figures.broken for row in rows)
            yield Rate(setting, key, kept, share(kept, len(rows)), bound.share)


def not_shown(campaign: Campaign) -> list[Rate]:
    """Return the rates whose share the runs refute or do not decide."""
    return [rate for rate in rates(campaign) if rate.showing not in (None, Showing.SHOWN)]


def holds(campaign: Campaign) -> bool:
    """Return whether every run holds and every share is shown."""
    return all(row.figures.holds for row in campaign.rows) and not not_shown(campaign)
