"""An impairment that the house does not have: every second copy is lost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment


@dataclass
class EverySecond(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST

    first: int = 0          # number of the first copy that is lost

    def carry(self, transit: Transit) -> Iterator[Transit]:
        if (transit.number - self.first) % 2:
            yield transit
