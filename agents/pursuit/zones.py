"""The field of view of an omnidirectional sensor and its parts (Figure 3.2).

    |p - q| <= eta           'No Moving Area' (3.7): the pursuer does not approach a target detected here
    R - |p - q| <= zeta      'Escape Area' (3.8): the pursuer looks if the target may be here

Distances to the boundary are signed: negative outside.
Differs from the dissertation: its infimum of norms has no sign and does not tell a target outside from one inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, isfinite

from agents.pursuit import Place


@dataclass(frozen=True)
class Zones:
    radius_m: float             # R
    no_moving_m: float          # eta
    escape_m: float             # zeta

    def __post_init__(self) -> None:
        if not (isfinite(self.radius_m) and self.radius_m > 0):
            raise ValueError(f"radius_m={self.radius_m}: expected more than 0")
        for name in ("no_moving_m", "escape_m"):
            if not 0 < getattr(self, name) < self.radius_m:
                raise ValueError(f"{name}={getattr(self, name)}: expected more than 0, less than the field of view's "
                                 f"radius, {self.radius_m} m")

    def distance_m(self, own: Place, target: Place) -> float:
        """Return the distance [m] from the target to the boundary, negative outside."""
        return self.radius_m - hypot(target[0] - own[0], target[1] - own[1])

    def stays(self, own: Place, target: Place) -> bool:
        """Return whether the target is in the no-moving area, so that the pursuer stays."""
        return hypot(target[0] - own[0], target[1] - own[1]) <= self.no_moving_m

    def may_escape(self, own: Place, target: Place) -> bool:
        """Return whether the target is in the escape area."""
        return 0 <= self.distance_m(own, target) <= self.escape_m
