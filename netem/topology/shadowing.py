"""Log-normal shadowing that is constant per place: what stands around a place weakens or strengthens its links [dB].

    link a - b:   X = sigma_db (G(a) + G(b)) / sqrt(2 (1 + rho(a, b)))          normal, mean 0, deviation sigma_db
    place p:      G(p) = sum w_i g_i / |w|                                      standard normal everywhere

g_i are standard normal numbers at the corners of a square lattice, each drawn from its own random stream, named by the
corner; w_i are the weights of bilinear interpolation at p, and rho(a, b) = w(a) w(b) / (|w(a)| |w(b)|) is the
correlation of G between two places. So the field depends on the seed only, is continuous, the same in both directions
of a link and the same whenever a robot comes back; and two links of one node have a correlation of 1/2 while their
other ends are far apart, as 3GPP assumes between sites (TR 36.814, table B.1.2.1-1).

Averaged over the position on the lattice, the correlation of G along its axes falls to 1/e at `correlation_m`, and to
exactly 0 from 2.22 `correlation_m` on. Differs from Gudmundson (1991), whose correlation is exp(-d / d_corr).

Not modelled: height (z is ignored), fading that changes with time or within a wavelength.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import floor, hypot, isfinite, sqrt
from random import Random
from statistics import NormalDist
from typing import Final

from netem.topology import Position

SPACINGS_TO_1_OVER_E: Final = 0.9001688492512677    # distance [lattice spacings] at which the mean correlation is 1/e
SMALLEST: Final = 2.0 ** -54                        # stands for a draw of 0, whose normal quantile is -infinity
Corner = tuple[int, int]

_quantile: Final = NormalDist().inv_cdf


@dataclass(frozen=True)
class Shadowing:
    sigma_db: float                     # >= 0
    correlation_m: float = 20.0         # > 0

    def __post_init__(self) -> None:
        if not (isfinite(self.sigma_db) and self.sigma_db >= 0):
            raise ValueError(f"sigma_db={self.sigma_db}: expected 0 or more")
        if not (isfinite(self.correlation_m) and self.correlation_m > 0):
            raise ValueError(f"correlation_m={self.correlation_m}: expected > 0")


class ShadowField:
    """The shadowing of one medium; `rng_for` returns the random stream of a name."""

    def __init__(self, settings: Shadowing, rng_for: Callable[[str], Random]) -> None:
        self._sigma_db = settings.sigma_db
        self._spacing_m = settings.correlation_m / SPACINGS_TO_1_OVER_E
        self._rng_for = rng_for
        self._drawn: dict[Corner, float] = {}

    def loss_db(self, one_m: Position, other_m: Position) -> float:
        """Return what shadowing adds to the loss between two positions."""
        one, other = self._weights(one_m), self._weights(other_m)
        shared = sum(weight * other[corner] for corner, weight in one.items() if corner in other)
        together = self._field(one) + self._field(other)
        return self._sigma_db * together / sqrt(2 * (1 + shared))

    def _weights(self, at_m: Position) -> dict[Corner, float]:
        """Return the weights of the corners around a place, with a sum of squares of 1."""
        x, y = at_m[0] / self._spacing_m, at_m[1] / self._spacing_m
        i, j = floor(x), floor(y)
        x, y = x - i, y - j
        norm = hypot(1 - x, x) * hypot(1 - y, y)
        return {(i, j): (1 - x) * (1 - y) / norm, (i + 1, j): x * (1 - y) / norm,
                (i, j + 1): (1 - x) * y / norm, (i + 1, j + 1): x * y / norm}

    def _field(self, weights: dict[Corner, float]) -> float:
        return sum(weight * self._at(corner) for corner, weight in weights.items() if weight)

    def _at(self, corner: Corner) -> float:
        drawn = self._drawn.get(corner)
        if drawn is None:
            i, j = corner
            drawn = self._drawn[corner] = _quantile(self._rng_for(f"shadowing.{i},{j}").random() or SMALLEST)
        return drawn
