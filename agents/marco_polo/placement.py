"""Places of the sensors at the start: the greatest P_S^k under a least area coverage (sections 2.1 and 2.4).

    maximize P_S^k   subject to   area coverage >= least,   platforms inside the area, side by side, not overlapping

P_S^k has many local maxima. SciPy's basin hopping anneals over them: sequential quadratic programming (SLSQP) climbs to
a local maximum under the constraints, one or two sensors are put elsewhere or all are shifted, and the next local
maximum is accepted by Metropolis' rule at a fixed temperature. SLSQP gets the gradients of both coverages; for P_S^k
the end of an interval counts where the number of others that contain it is exactly k - 1.

For the team of section 2.4 a hop takes some 0.5 s: keep the result, do not compute it in a game.
Not modelled: obstacles and zones.

Source: dissertation, sections 2.1 and 2.4; Wales and Doye 1997 (basin hopping); Kraft 1988 (SLSQP).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import basinhopping

from agents.marco_polo.area_coverage import area_coverage, area_coverage_gradient, greatest_area_coverage
from agents.marco_polo.sight import Floats, boundary, fields_of_view, seen
from agents.marco_polo.track_coverage import Headings, track_coverage
from agents.pursuit.law import Area

SEARCH_CELLS = 80               # boundary cells and scan lines during the search
SEARCH_LINES = 200
RESULT_CELLS = 800              # boundary cells for the coverage of a result
AREA_MARGIN = 2e-4              # for the coarser scan lines of the search
TEMPERATURE = 0.005             # a local maximum that is lower by this is accepted with probability 1/e
SHIFT_M = 0.5                   # standard deviation of a shift of all sensors
CLIMB_STEPS = 100               # of SLSQP, at most
STEP_M = 1e-6                   # of the difference quotient of an interval's end
OVERLAP_M = 1e-6                # of two platforms that counts as touching


@dataclass(frozen=True)
class Placement:
    centres_m: Floats           # (m, 2)
    track_coverage: float       # P_S^k
    area_coverage: float        # share of the area


def place_sensors(area: Area, radii_m: ArrayLike, k: int, least_area_coverage: float, generator: np.random.Generator,
                  *, platform_m: float = 0.5, headings: Headings = Headings.UNIFORM, hops: int = 50) -> Placement:
    """Return the best placement found of m sensors; `generator` decides it.

    ValueError if the radii cannot cover `least_area_coverage`, if k is not in 1 to m, if a platform does not fit into
    the area, or if no placement that satisfies the constraints was found."""
    _, radii = fields_of_view(np.zeros((np.size(radii_m), 2)), np.ravel(radii_m))
    problem = _Problem(area, radii, k, least_area_coverage, platform_m, headings)
    low, high = np.array(problem.bounds).T
    best: Placement | None = None

    def elsewhere(x: Floats) -> Floats:
        """One or two sensors at random places, or all shifted."""
        if generator.random() < 0.5:
            return np.clip(x + generator.normal(0.0, SHIFT_M, x.shape), low, high)
        moved = np.repeat(np.isin(np.arange(len(radii)), generator.choice(len(radii), generator.integers(1, 3))), 2)
        return np.where(moved, generator.uniform(low, high), x)

    def accept(*, x_new: Floats, **_: Any) -> bool:
        nonlocal best
        found = problem.placement(x_new)
        if not problem.satisfied(found):
            return False
        if best is None or found.track_coverage > best.track_coverage:
            best = found
        return True

    constraints = [{"type": "ineq", "fun": problem.spare_area, "jac": problem.spare_area_gradient}]
    if len(radii) > 1:
        constraints.append({"type": "ineq", "fun": problem.gaps_m})
    local = {"method": "SLSQP", "jac": True, "bounds": problem.bounds, "constraints": constraints,
             "options": {"maxiter": CLIMB_STEPS}}
    search: Any = basinhopping                  # its stubs know neither jac=True nor constraints with a jac
    search(problem.cost_and_gradient, generator.uniform(low, high), niter=hops, T=TEMPERATURE, take_step=elsewhere,
           accept_test=accept, rng=generator, minimizer_kwargs=local)
    if best is None:
        raise ValueError(f"least_area_coverage={least_area_coverage}: no placement found in {hops} hops that covers it "
                         f"with platforms of {platform_m} m side by side; the radii cover at most "
                         f"{greatest_area_coverage(area, radii):.4f} without overlap: lower it, or take more hops")
    return best


class _Problem:
    """The optimization problem; x holds the centres, shape (2 m,), sensor by sensor."""

    def __init__(self, area: Area, radii: Floats, k: int, least: float, platform_m: float, headings: Headings) -> None:
        if not 1 <= k <= len(radii):
            raise ValueError(f"k={k}: {len(radii)} sensors give 1 to {len(radii)} detections of a track")
        limit = greatest_area_coverage(area, radii)
        if not 0 <= least <= limit:
            raise ValueError(f"least_area_coverage={least}: the radii cover at most {limit:.4f} of the area; take 0 to "
                             "that")
        narrow = min(area.x_m[1] - area.x_m[0], area.y_m[1] - area.y_m[0])
        if not 0 <= platform_m < narrow:
            raise ValueError(f"platform_m={platform_m}: expected 0 or more and less than the area's side, {narrow}")
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
        return found.area_coverage >= self.least and bool(np.all(self.gaps_m(found.centres_m.ravel()) >= -OVERLAP_M))

    def spare_area(self, x: Floats) -> float:
        if self.least == 0.0:
            return 1.0
        return area_coverage(self.area, x.reshape(-1, 2), self.radii, SEARCH_LINES) - self.least - AREA_MARGIN

    def spare_area_gradient(self, x: Floats) -> Floats:
        if self.least == 0.0:
            return np.zeros(len(x))
        return area_coverage_gradient(self.area, x.reshape(-1, 2), self.radii, SEARCH_LINES).ravel()

    def gaps_m(self, x: Floats) -> Floats:
        """Distance [m] between each two platforms, squares with parallel sides; negative if they overlap."""
        centres = x.reshape(-1, 2)
        distances = np.max(np.abs(centres[:, None] - centres[None]), axis=-1)
        return np.asarray(distances[self.pairs] - self.platform_m)

    def cost_and_gradient(self, x: Floats) -> tuple[float, Floats]:
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
