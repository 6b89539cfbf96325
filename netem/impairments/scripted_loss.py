"""Loss by script: exactly the named frames are lost. A link numbers its frames from 0.

`lose_frames = [3, 7]` loses two frames; with `every = 10` the script repeats: 3, 7, 13, 17, 23, ...
Frames that enter the link outside a time window are numbered too. Duplicates have the number of their original; with
`copy` only the original, 0, or that duplicate, 1, 2, ..., is lost.

Not modelled: chance. For loss during a time instead of by number use `bernoulli_loss` of 1 with a time window.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.checks import expect_at_least


@dataclass
class ScriptedLoss(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST
    only_loses: ClassVar[bool] = True

    lose_frames: list[int]                  # each >= 0, and < every
    every: int | None = None                # [frames], None: the script does not repeat
    copy: int | None = None                 # >= 0, None: the original and its duplicates

    def __post_init__(self) -> None:
        if not self.lose_frames:
            raise ValueError("lose_frames=[]: name at least one frame")
        if self.every is not None:
            expect_at_least("every", self.every, 1)
        if self.copy is not None:
            expect_at_least("copy", self.copy, 0)
        wrong = [n for n in self.lose_frames if n < 0 or (self.every is not None and n >= self.every)]
        if wrong:
            upper = "" if self.every is None else f" < every ({self.every})"
            raise ValueError(f"lose_frames={wrong}: expected 0 <= number{upper}")
        self._lose = frozenset(self.lose_frames)

    def carry(self, transit: Transit) -> Iterator[Transit]:
        number = transit.number if self.every is None else transit.number % self.every
        if number not in self._lose or self.copy not in (None, transit.copy):
            yield transit
