"""Impairments: what happens to one frame copy on one directed link.

A member of this kind is a class with one verb, `carry`: it yields what comes out of the link for one copy that goes in:
nothing (lost, counted under `loses_as`), the copy, the copy later, changed, or twice. Impairments of a link compose in
the order in which the scenario lists them; each owns a random stream named by the seed and its place in the scenario.

A member may have three more methods; the caller takes the default where one is missing:

    carry_outside(transit)      a copy that enters outside the impairment's time window; default: the copy, unchanged
    least_delay_ns(size_bytes)  no copy of this size comes out earlier than this after it went in; default: 0
    most_delay_ns(flow)         adds at most this to the greatest delay of the copies of this flow; default: not known
    most_copies                 a constant: how many copies come out for one at most; default: 1
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from netem.core.fate import Fate
from netem.core.transit import Transit


class Impairment(Protocol):
    @property
    def loses_as(self) -> Fate:
        """The fate of a copy for which `carry` yields nothing; members have it as a class constant."""
        ...

    def carry(self, transit: Transit) -> Iterable[Transit]: ...
