"""Impairments: what happens to one frame copy on one directed link.

A member of this kind is a class with one verb, `carry`: it yields what comes out of the link for one copy that goes in:
nothing (lost, counted under `loses_as`), the copy, the copy later, changed, or twice. Impairments of a link compose in
the order in which the scenario lists them; each owns a random stream named by the seed and its place in the scenario.

A member that delays every copy says how much at least, by `least_delay_ns(size_bytes)`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from netem.fate import Fate
from netem.transit import Transit


class Impairment(Protocol):
    @property
    def loses_as(self) -> Fate:
        """The fate of a copy for which `carry` yields nothing; members have it as a class constant."""
        ...

    def carry(self, transit: Transit) -> Iterable[Transit]: ...
