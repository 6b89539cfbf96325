"""Bursty frame loss: a two-state Markov chain (Gilbert 1960, Elliott 1963), set by loss ratio and mean burst length.

    GOOD --p_enter--> BAD --p_leave--> GOOD          one transition per frame copy, then the loss; starts GOOD
    share of BAD s = p_enter / (p_enter + p_leave)   mean burst = 1 / p_leave  [frames]
    loss ratio = s loss_while_bad + (1 - s) loss_while_good

A burst is a stay in BAD; by default all its frames are lost and no other is.

Not modelled: loss that depends on frame length; bursts that last a time (see `gilbert_elliott_by_time`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from random import Random
from typing import ClassVar

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.checks import expect_ratio_below_one
from netem.impairments.loss_in_states import expect_losses, survives


@dataclass
class GilbertElliott(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST

    loss_ratio: float                       # 0 <= loss_ratio < 1
    mean_burst_frames: float                # >= 1
    loss_while_bad: float = 1.0             # loss_ratio < loss_while_bad <= 1, or both 0
    loss_while_good: float = 0.0            # 0 <= loss_while_good <= loss_ratio
    rng: Random = field(kw_only=True)
    bad: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        expect_ratio_below_one("loss_ratio", self.loss_ratio)
        if not 1 <= self.mean_burst_frames < float("inf"):
            raise ValueError(f"mean_burst_frames={self.mean_burst_frames}: a burst holds at least 1 frame")
        expect_losses(self.loss_while_bad, self.loss_while_good)
        if not self.loss_while_good <= self.loss_ratio < self.loss_while_bad:
            raise ValueError(f"loss_ratio={self.loss_ratio}: expected loss_while_good ({self.loss_while_good}) <= "
                             f"loss_ratio < loss_while_bad ({self.loss_while_bad})")
        share = (self.loss_ratio - self.loss_while_good) / (self.loss_while_bad - self.loss_while_good)
        self.p_leave = 1 / self.mean_burst_frames
        self.p_enter = self.p_leave * share / (1 - share)
        if self.p_enter > 1:
            raise ValueError(f"loss_ratio={self.loss_ratio} is out of reach with bursts of {self.mean_burst_frames} "
                             f"frames: raise mean_burst_frames to {share / (1 - share):g} or more")

    def carry(self, transit: Transit) -> Iterator[Transit]:
        if self.rng.random() < (self.p_leave if self.bad else self.p_enter):
            self.bad = not self.bad
        if survives(self.loss_while_bad if self.bad else self.loss_while_good, self.rng):
            yield transit
