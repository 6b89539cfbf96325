"""Duplication: with probability `duplicate_ratio` a copy arrives twice (`tc netem duplicate`).

The original passes first and unchanged; its duplicate arrives `extra_delay_ns` later and passes the impairments listed
after this one by itself. With `correlation` the duplicated copies cluster; their ratio stays exact.

Not modelled: more than one duplicate (list `duplicate` twice).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from random import Random
from typing import ClassVar

from msgspec.structs import replace

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.checks import expect_at_least, expect_ratio
from netem.impairments.correlated_uniforms import correlated_uniforms
from netem.impairments.flow import Flow


@dataclass
class Duplicate(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST
    most_copies: ClassVar[int] = 2

    duplicate_ratio: float                  # 0 <= duplicate_ratio <= 1
    extra_delay_ns: int = 0                 # >= 0
    correlation: float = 0.0                # rank correlation of successive draws, in (-1, 1)
    rng: Random = field(kw_only=True)

    def __post_init__(self) -> None:
        expect_ratio("duplicate_ratio", self.duplicate_ratio)
        expect_at_least("extra_delay_ns", self.extra_delay_ns, 0)
        self._draw = correlated_uniforms(self.rng, self.correlation)

    def carry(self, transit: Transit) -> Iterator[Transit]:
        yield transit
        if self._draw() < self.duplicate_ratio:
            yield replace(transit, arrival_ns=transit.arrival_ns + self.extra_delay_ns)

    def most_delay_ns(self, flow: Flow) -> int:
        """The delay of a duplicate."""
        return self.extra_delay_ns if self.duplicate_ratio else 0
