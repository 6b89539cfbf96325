"""Two-ray ground reflection: free space up to a crossover distance, beyond it the ray off the ground cancels the direct
one, and the loss grows with the fourth power of the distance (Rappaport, Wireless Communications, 2nd ed., 4.6).

    d <= dc:  loss_db = 20 log10(4 pi d / wavelength)              dc = 4 pi h_t h_r / wavelength      [m, Hz]
    d >  dc:  loss_db = 40 log10(d) - 20 log10(h_t h_r)            equal at dc

h_t and h_r are the heights of the antennas: `antenna_height_m`, plus the z coordinate of a node that has one and is
above the ground.

Not modelled: the ripple of the two rays before the crossover, the ground's reflection coefficient, antennas' patterns.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log10, pi
from typing import Final

from netem.topology import Position

SPEED_OF_LIGHT_MPS: Final = 299_792_458.0


@dataclass(frozen=True)
class TwoRay:
    antenna_height_m: float             # > 0
    frequency_hz: float = 2.45e9        # > 0

    def __post_init__(self) -> None:
        for name in ("antenna_height_m", "frequency_hz"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)}: expected > 0")

    @property
    def wavelength_m(self) -> float:
        return SPEED_OF_LIGHT_MPS / self.frequency_hz

    def height_m(self, at_m: Position) -> float:
        return self.antenna_height_m + (max(0.0, at_m[2]) if len(at_m) > 2 else 0.0)

    def crossover_m(self, one_m: Position, other_m: Position) -> float:
        return 4 * pi * self.height_m(one_m) * self.height_m(other_m) / self.wavelength_m

    def loss_db(self, one_m: Position, other_m: Position, d_m: float) -> float:
        """Return the loss between two positions that are `d_m` > 0 apart."""
        if d_m <= self.crossover_m(one_m, other_m):
            return 20 * log10(4 * pi * d_m / self.wavelength_m)
        return 40 * log10(d_m) - 20 * log10(self.height_m(one_m) * self.height_m(other_m))
