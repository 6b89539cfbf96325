"""Places of the sensors at the start: the greatest P_S^k under a least area coverage (sections 2.1 and 2.4).

    maximize P_S^k   subject to   area coverage >= least,   platforms inside the area, side by side, not overlapping

P_S^k has many local maxima. SciPy's generalized simulated annealing (`dual_annealing`) searches them with penalties for
what violates a constraint; sequential quadratic programming (SLSQP) then climbs to the top of the hill, with the exact
constraints. Each restart anneals anew, and the best result that satisfies the constraints is taken. SLSQP gets the
gradient of P_S^k: the end of an interval counts where the number of others that contain it is exactly k - 1.

For the team of section 2.4 one restart takes about 15 s; use the result, do not compute it in a game.
Not modelled: obstacles and zones.

Source: dissertation, sections 2.1 and 2.4; Xiang et al. 1997 (annealing); Kraft 1988 (SLSQP).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import dual_annealing, minimize

from agents.marco_polo.area_coverage import area_coverage, greatest_area_coverage
from agents.marco_polo.sight import Floats, boundary, fields_of_view, seen
from agents.marco_polo.track_coverage import Headings, track_coverage
from agents.pursuit.law import Area

SEARCH_CELLS = 80               # boundary cells and scan lines during the search
SEARCH_LINES = 100
RESULT_CELLS = 800              # of the result
START_TEMPERATURE = 50.0        # SciPy's default, 5230, is for costs that differ by more than 1
AREA_PENALTY = 3.0              # per share of the area missing: above the greatest gain in P_S^k
OVERLAP_PENALTY_PER_M = 2.0
AREA_MARGIN = 1e-3              # for the coarser scan lines of the search
STEP_M = 1e-6                   # of the difference quotient of an interval's end


@dataclass(frozen=True)
class Placement:
    centres_m: Floats           # (m, 2)
    track_coverage: float       # P_S^k
    area_coverage: float        # share of the area


def place_sensors(area: Area, radii_m: ArrayLike, k: int, least_area_coverage: float, generator: np.random.Generator,
                  *, platform_m: float = 0.5, headings: Headings = Headings.UNIFORM, restarts: int = 3,
                  iterations: int = 1000) -> Placement:
    """Return the best placement found of m sensors; `generator` decides it.

    ValueError if the radii cannot cover `least_area_coverage`, if k is not in 1 to m, or if no placement satisfies the
    constraints."""
    _, radii = fields_of_view(np.zeros((np.size(radii_m), 2)), radii_m)
    problem = _Problem(area, radii, k, least_area_coverage, platform_m, headings)
    best: Placement | None = None
    for _ in range(restarts):
        annealed = dual_annealing(problem.penalized, problem.bounds, maxiter=iterations, rng=generator,
                                  no_local_search=True, initial_temp=START_TEMPERATURE).x
        for x in (annealed, problem.climb(annealed)):
            found = problem.placement(x)
            if problem.satisfied(found) and (best is None or found.track_coverage > best.track_coverage):
                best = found
    if best is None:
        raise ValueError(f"least_area_coverage={least_area_coverage}: no placement found in {restarts} restarts that "
                         f"covers it with platforms of {platform_m} m side by side; the radii cover at most "
                         f"{greatest_area_coverage(area, radii):.4f} without overlap: lower it, or try more restarts")
    return best


class _Problem:
    """The optimization problem; x holds the centres, shape (2 m,), sensor by sensor."""

    def __init__(self, area: Area, radii: Floats, k: int, least: float, platform_m: float, headings: Headings) -> None:
        if not 1 <= k <= len(radii):
            raise ValueError(f"k={k}: {len(radii)} sensors give 1 to {len(radii)} detections of a track")
        limit = greatest_area_coverage(area, radii)
        if not 0 <= least <= limit:
            raise ValueError(f"least_area_coverage={least}: the radii cover between 0 and {limit:.4f} of the area; take "
                             "a value in between")
        self.area, self.radii, self.k, self.least = area, radii, k, least
        self.platform_m, self.headings = platform_m, headings
        half = 0.5 * platform_m
        self.bounds = [(low + half, high - half) for _ in radii for low, high in (area.x_m, area.y_m)]
        self.pairs = np.triu_indices(len(radii), 1)

    def placement(self, x: Floats) -> Placement:
        centres = x.reshape(-1, 2)
        covered = track_coverage(self.area, centres, self.radii, self.headings, RESULT_CELLS)
        return Placement(centres, float(covered[self.k - 1]), area_coverage(self.area, centres, self.radii))

    def satisfied(self, found: Placement) -> bool:
        gaps = self._gaps(found.centres_m.ravel())
        return found.area_coverage >= self.least and not (len(gaps) and gaps.min() < -1e-9)

    def penalized(self, x: Floats) -> float:
        centres = x.reshape(-1, 2)
        covered = track_coverage(self.area, centres, self.radii, self.headings, SEARCH_CELLS)[self.k - 1]
        missing = max(0.0, -self._spare_area(x))
        overlap = float(np.sum(np.maximum(0.0, -self._gaps(x))))
        return -float(covered) + AREA_PENALTY * missing + OVERLAP_PENALTY_PER_M * overlap

    def climb(self, x: Floats) -> Floats:
        """Return a local optimum near x."""
        constraints = [{"type": "ineq", "fun": self._spare_area}]
        if len(self.radii) > 1:
            constraints.append({"type": "ineq", "fun": self._gaps})
        found = minimize(self._cost_and_gradient, x, jac=True, method="SLSQP", bounds=self.bounds,
                         constraints=constraints, options={"maxiter": 150})
        low, high = np.array(self.bounds).T
        return np.clip(found.x, low, high)

    def _spare_area(self, x: Floats) -> float:
        if self.least == 0.0:
            return 1.0
        return area_coverage(self.area, x.reshape(-1, 2), self.radii, SEARCH_LINES) - self.least - AREA_MARGIN

    def _gaps(self, x: Floats) -> Floats:
        """Distance [m] between each two platforms, squares with parallel sides; negative if they overlap."""
        centres = x.reshape(-1, 2)
        distances = np.max(np.abs(centres[:, None] - centres[None]), axis=-1)
        return np.asarray(distances[self.pairs] - self.platform_m)

    def _cost_and_gradient(self, x: Floats) -> tuple[float, Floats]:
        """-P_S^k and its gradient, shape (2 m,): how each interval's ends move with the centre, where they count."""
        centres, count, k = x.reshape(-1, 2), len(self.radii), self.k
        edge = boundary(self.area, SEARCH_CELLS)
        moved = np.concatenate([centres, centres + [STEP_M, 0.0], centres + [0.0, STEP_M]])
        low, high = (self.headings.share(end) for end in seen(self.area, edge.places_m, edge.axes_rad, moved,
                                                              np.tile(self.radii, 3)))
        ends = np.concatenate([low[:, :count], high[:, :count]], axis=1)
        order = np.argsort(ends, axis=1)
        step = np.where(order < count, 1, -1)
        depth = np.cumsum(step, axis=1)
        covered = np.sum(edge.weights[:, None] * np.diff(np.take_along_axis(ends, order, axis=1), axis=1)
                         * (depth[:, :-1] >= k))
        decisive = np.maximum(depth, depth - step) == k         # the number of intervals changes between k - 1 and k
        slope = np.zeros_like(ends)
        np.put_along_axis(slope, order, np.where(decisive, -step, 0) * edge.weights[:, None], axis=1)
        gradient = np.empty((count, 2))
        for axis in (0, 1):
            of_axis = np.s_[:, (axis + 1) * count:(axis + 2) * count]
            gradient[:, axis] = (np.sum(slope[:, :count] * (low[of_axis] - low[:, :count]), axis=0)
                                 + np.sum(slope[:, count:] * (high[of_axis] - high[:, :count]), axis=0)) / STEP_M
        return -float(covered), -gradient.ravel()
