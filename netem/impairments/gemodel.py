"""Bursty frame loss by the four numbers of Linux netem: `tc netem loss gemodel p r 1-h 1-k`.

    GOOD --p--> BAD --r--> GOOD      a frame copy is lost with 1-k while GOOD and 1-h while BAD, then the transition;
                                     starts GOOD
    loss ratio = (p (1-h) + r (1-k)) / (p + r)       mean stay in BAD = 1 / r  [frames]

Source: netem's `loss_gilb_ell`, after Salsano, Ludovici, Ordine 2009; Gilbert 1960, Elliott 1963. `gilbert_elliott` is
the same chain, set by its loss ratio.

Not modelled: loss that depends on frame length; stays that last a time (see `gilbert_elliott_by_time`).
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
from netem.impairments.loss_in_states import survives


@dataclass
class Gemodel(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST

    p: float                                # 0 to 1: GOOD -> BAD
    r: float | None = None                  # > 0, at most 1: BAD -> GOOD; None: 1 - p
    one_minus_h: float = 1.0                # 0 to 1: loss while BAD
    one_minus_k: float = 0.0                # 0 to 1: loss while GOOD
    rng: Random = field(kw_only=True)
    bad: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        self._leave = 1 - self.p if self.r is None else self.r
        for name, value in (("p", self.p), ("r", self._leave), ("one_minus_h", self.one_minus_h),
                            ("one_minus_k", self.one_minus_k)):
            expect_ratio(name, value)
        if self.p > 0 and self._leave == 0:
            raise ValueError(f"r={self._leave}: the bad state would never end: expected more than 0")

    def carry(self, transit: Transit) -> Iterator[Transit]:
        lost = not survives(self.one_minus_h if self.bad else self.one_minus_k, self.rng)
        if self.rng.random() < (self._leave if self.bad else self.p):
            self.bad = not self.bad
        if not lost:
            yield transit
