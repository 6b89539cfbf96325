"""Independent frame loss: each copy is lost with probability `loss_ratio`, whatever happened before (`tc netem loss`).

Not modelled: loss that depends on frame length, time or distance; netem's deprecated correlation
(use `gilbert_elliott`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from random import Random
from typing import ClassVar

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.checks import expect_ratio


@dataclass
class BernoulliLoss(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST
    only_loses: ClassVar[bool] = True

    loss_ratio: float                       # 0 <= loss_ratio <= 1
    rng: Random = field(kw_only=True)

    def __post_init__(self) -> None:
        expect_ratio("loss_ratio", self.loss_ratio)

    def carry(self, transit: Transit) -> Iterator[Transit]:
        if self.rng.random() >= self.loss_ratio:
            yield transit
