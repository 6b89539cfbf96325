"""Impairments: what happens to one frame copy on one directed link.

A member of this kind is a class with one verb, `carry`: it yields what comes out of the link for one copy that goes in:
nothing (lost, counted under `loses_as`), the copy, the copy later, changed, or twice. Impairments of a link compose in
the order in which the scenario lists them; each owns a random stream named by the seed and its place in the scenario.

A member inherits `Impairment`, which answers everything else by a default. A class of an author's own need not: it has
`carry` and `loses_as` (contract.py), and `carry_outside` if it promises an order.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, ClassVar

from netem.core.fate import Fate
from netem.core.transit import Transit

if TYPE_CHECKING:
    from netem.impairments.flow import Flow


class Impairment:
    loses_as: ClassVar[Fate]                # the fate of a copy for which `carry` yields nothing
    most_copies: ClassVar[int] = 1          # most copies that leave for one that enters
    only_loses: ClassVar[bool] = False      # whether a copy that it does not lose leaves as it entered
    only_delays: ClassVar[bool] = False     # whether each copy leaves once, as it entered, at once or later

    def written_out(self) -> bool:
        """Return whether a search writes out what it does copy by copy: it draws, or is a script. Else it stays whole.

        What does not draw does the same wherever it stands in the list of impairments.
        """
        return self.only_loses or hasattr(self, "rng")

    def carry(self, transit: Transit) -> Iterable[Transit]:
        """Yield the copies that leave the link for one that enters: none, late, changed or several."""
        raise NotImplementedError

    def carry_outside(self, transit: Transit) -> Transit:
        """Return a copy that enters outside the impairment's time window; the default passes it as it is."""
        return transit

    def least_delay_ns(self, size_bytes: int) -> int:
        """Return the least delay [ns] of a copy of this size."""
        return 0

    def most_delay_ns(self, flow: Flow) -> int:
        """Return a bound [ns] on the increase of the greatest delay of the copies of this flow."""
        return 0
