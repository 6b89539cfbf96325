"""Fades that last a time: a two-state Markov chain in continuous time (Gilbert 1960, Elliott 1963, by seconds).

    GOOD --1/mean_good--> BAD --1/mean_bad--> GOOD       stays are exponential; lost with a probability per state
    share of BAD s = mean_bad / (mean_good + mean_bad)   loss ratio = s loss_while_bad + (1 - s) loss_while_good
    P(BAD at t + d | BAD at t) = s + (1 - s) exp(-d (1 / mean_good + 1 / mean_bad))

The chain starts in its stationary distribution. Its stays are drawn one after the other, whether or not frames come, so
the state at an instant depends on the seed alone: neither the rate of the frames nor a further link that shares the
state (`shared`) changes it. Only a loss that is neither 0 nor 1 costs a draw per frame, from the same stream.

Invariants:
- `_edges` are the instants at which the state changes, in order; `_bad_first` is the state before the first;
- edges older than `KEPT_NS` before the latest question may be gone, two at a time.

Not modelled: loss that depends on frame length.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import log1p
from random import Random
from typing import ClassVar, Final

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.checks import expect_at_least
from netem.impairments.loss_in_states import expect_losses, survives

SHORTEST_CYCLE_NS: Final = 1_000_000    # of both means; a shorter one would cost thousands of draws per frame
KEPT_NS: Final = 60_000_000_000         # media with different latencies ask in a slightly different order
MOST_EDGES: Final = 4096


@dataclass
class GilbertElliottByTime(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST

    mean_good_ns: int                       # > 0
    mean_bad_ns: int                        # > 0
    loss_while_bad: float = 1.0             # loss_while_good < loss_while_bad <= 1
    loss_while_good: float = 0.0
    rng: Random = field(kw_only=True)

    def __post_init__(self) -> None:
        expect_at_least("mean_good_ns", self.mean_good_ns, 1)
        expect_at_least("mean_bad_ns", self.mean_bad_ns, 1)
        expect_losses(self.loss_while_bad, self.loss_while_good)
        cycle_ns = self.mean_good_ns + self.mean_bad_ns
        if cycle_ns < SHORTEST_CYCLE_NS:
            raise ValueError(f"mean_bad_ns={self.mean_bad_ns}: expected mean_good_ns + mean_bad_ns >= "
                             f"{SHORTEST_CYCLE_NS}; for shorter fades use bernoulli_loss")
        self._losses = Random(self.rng.random())
        self._bad_first = self.rng.random() < self.mean_bad_ns / cycle_ns
        self._edges = [self._stay_ns(self._bad_first)]

    def carry(self, transit: Transit) -> Iterator[Transit]:
        bad = self.bad_at(transit.sent_ns)
        if survives(self.loss_while_bad if bad else self.loss_while_good, self._losses):
            yield transit

    def bad_at(self, t_ns: int) -> bool:
        """Return whether the chain is in BAD at `t_ns`, at most `KEPT_NS` before the latest instant asked for."""
        edges = self._edges
        while edges[-1] <= t_ns:
            edges.append(edges[-1] + self._stay_ns(self._bad_first ^ bool(len(edges) & 1)))
        passed = bisect_right(edges, t_ns)
        bad = self._bad_first ^ bool(passed & 1)
        if passed > MOST_EDGES:
            old = bisect_right(edges, t_ns - KEPT_NS) & ~1
            del edges[:old]
        return bad

    def _stay_ns(self, bad: bool) -> int:
        mean_ns = self.mean_bad_ns if bad else self.mean_good_ns
        return round(-mean_ns * log1p(-self.rng.random()))
