"""Loss by a four-state Markov chain: `tc netem loss state p13 p31 p32 p23 p14` (Salsano, Ludovici, Ordine 2009).

    1 GOOD ------p13-----> 3 BURST_LOSS ---p32--> 2 BURST_GOOD        one transition per frame copy, starts GOOD;
    1 GOOD <-----p31------ 3 BURST_LOSS <--p23--- 2 BURST_GOOD        lost while in 3 or 4
    1 GOOD ------p14-----> 4 ISOLATED_LOSS --1--> 1 GOOD
    loss ratio = (p14 + p13/p31) / (1 + p14 + p13/p31 (1 + p32/p23))

As in Linux netem, p13 alone gives independent loss; p31 adds bursts, p32 and p23 good frames within bursts, and p14
isolated losses.

Not modelled: loss that depends on frame length, time or distance.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from random import Random
from typing import ClassVar

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.checks import expect_ratio


class State(Enum):
    GOOD = "received, between bursts"
    BURST_GOOD = "received, within a burst"
    BURST_LOSS = "lost within a burst"
    ISOLATED_LOSS = "lost alone"


@dataclass
class FourStateLoss(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST
    only_loses: ClassVar[bool] = True

    p13: float
    p31: float | None = None                # None: 1 - p13
    p32: float = 0.0
    p23: float = 1.0
    p14: float = 0.0
    rng: Random = field(kw_only=True)
    state: State = field(default=State.GOOD, init=False)

    def __post_init__(self) -> None:
        leave_burst = 1 - self.p13 if self.p31 is None else self.p31
        for name, p in (("p13", self.p13), ("p31", leave_burst), ("p32", self.p32), ("p23", self.p23),
                        ("p14", self.p14)):
            expect_ratio(name, p)
        if self.p13 + self.p14 > 1:
            raise ValueError(f"p13={self.p13}, p14={self.p14}: expected p13 + p14 <= 1")
        if leave_burst + self.p32 > 1:
            raise ValueError(f"p31={leave_burst}, p32={self.p32}: expected p31 + p32 <= 1")
        if self.p13 > 0 and leave_burst + self.p32 == 0:
            raise ValueError("p31=0, p32=0: a burst would never end: raise p31")
        if self.p32 > 0 and self.p23 == 0:
            raise ValueError(f"p23=0, p32={self.p32}: good reception within a burst would never end: raise p23")
        self._leave_burst = leave_burst

    def carry(self, transit: Transit) -> Iterator[Transit]:
        u = self.rng.random()
        if self.state is State.GOOD:
            if u < self.p14:
                self.state = State.ISOLATED_LOSS
            elif u < self.p14 + self.p13:
                self.state = State.BURST_LOSS
        elif self.state is State.BURST_LOSS:
            if u < self.p32:
                self.state = State.BURST_GOOD
            elif u < self.p32 + self._leave_burst:
                self.state = State.GOOD
        elif self.state is State.BURST_GOOD:
            if u < self.p23:
                self.state = State.BURST_LOSS
        else:
            self.state = State.GOOD
        if self.state is State.GOOD or self.state is State.BURST_GOOD:
            yield transit
