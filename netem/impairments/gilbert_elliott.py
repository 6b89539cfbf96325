"""Bursty frame loss: a two-state Markov chain (Gilbert 1960, Elliott 1963), set by loss ratio and mean burst length.

    GOOD --p_enter--> BAD --p_leave--> GOOD          one transition per frame copy, lost while BAD; starts GOOD
    loss ratio = p_enter / (p_enter + p_leave)       mean burst = 1 / p_leave  [frames]

Not modelled: loss while GOOD and survival while BAD (see `four_state_loss`); loss that depends on frame length or time.
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


@dataclass
class GilbertElliott(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST
    only_loses: ClassVar[bool] = True

    loss_ratio: float                       # 0 <= loss_ratio < 1
    mean_burst_frames: float                # >= 1
    rng: Random = field(kw_only=True)
    bad: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        expect_ratio_below_one("loss_ratio", self.loss_ratio)
        if not 1 <= self.mean_burst_frames < float("inf"):
            raise ValueError(f"mean_burst_frames={self.mean_burst_frames}: a burst holds at least 1 frame")
        self.p_leave = 1 / self.mean_burst_frames
        self.p_enter = self.p_leave * self.loss_ratio / (1 - self.loss_ratio)
        if self.p_enter > 1:
            raise ValueError(f"loss_ratio={self.loss_ratio} is out of reach with bursts of {self.mean_burst_frames} "
                             f"frames: raise mean_burst_frames to {self.loss_ratio / (1 - self.loss_ratio):g} or more")

    def carry(self, transit: Transit) -> Iterator[Transit]:
        if self.rng.random() < (self.p_leave if self.bad else self.p_enter):
            self.bad = not self.bad
        if not self.bad:
            yield transit
