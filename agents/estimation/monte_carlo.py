"""Monte Carlo runs of one filter on one path with n detections: the cells of Tables 3.1 to 3.4.

    detections at instants floor(i N / n), i = 0 .. n - 1, with noise of variance R in x and y; the circle filter, which
    gets no initial state, gets two more, at instants 1 and 2, which the tables do not count
    error of a run = sqrt(mean over all N instants of the squared distance); at an instant with a detection, after it
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import NamedTuple

import numpy as np

from agents.estimation import Estimator, Inputs
from agents.estimation.circle_filter import CircleFilter
from agents.estimation.particle_filter import ParticleFilter
from agents.estimation.paths import INSTANTS, STEP_NS, Floats, Path
from agents.estimation.unscented_kalman import UnscentedKalman

MEASURED_M2 = 0.01                  # R, variance of a detection's x and y
POSITION_M2, HEADING_RAD2 = 0.01, 0.7 ** 2      # variances of the filters' initial state
Build = Callable[[tuple[float, float, float], Inputs, np.random.Generator], Estimator]


def unscented(start: tuple[float, float, float], inputs: Inputs, rng: np.random.Generator) -> Estimator:
    """Return a Kalman filter whose initial mean is drawn around the true `start`."""
    x, y, theta = start
    dx, dy = sqrt(POSITION_M2) * rng.standard_normal(2)
    return UnscentedKalman((x + dx, y + dy, theta + sqrt(HEADING_RAD2) * rng.standard_normal()),
                           (POSITION_M2, POSITION_M2, HEADING_RAD2), 0, inputs)


def particles(start: tuple[float, float, float], inputs: Inputs, rng: np.random.Generator) -> Estimator:
    """Return a particle filter whose initial particles are drawn around the true `start`."""
    return ParticleFilter(start, (POSITION_M2, POSITION_M2, HEADING_RAD2), rng, 0, inputs)


def circle(window: int, *, motion: str = "mean", rho_m: float = 0.1, line_gate: bool = True) -> Build:
    """Return a maker of circle filters; the tables use `window` (Gamma) 17 for the circular path, 3 for zig-zag."""
    return lambda start, inputs, rng: CircleFilter(window, rho_m=rho_m, v_max_mps=0.7, sigma_m=sqrt(MEASURED_M2),
                                                   line_gate=line_gate, motion=motion)


FILTERS: dict[str, Build] = {"UKF": unscented, "PF": particles}


class Followed(NamedTuple):
    """One run of one filter on one path, at every instant."""

    expected: Floats            # shape (786, 2) [m]
    detections: Floats          # shape (n, 3): t [s], x, y [m]
    errors_m: Floats            # shape (786,)

    @property
    def error_m(self) -> float:
        return float(np.sqrt(np.mean(self.errors_m ** 2)))


def errors_m(build: Build, path: Path, detections: int, runs: int, seed: int = 0, *, first: int = 1,
             progress: Callable[[], None] = lambda: None) -> Floats:
    """Return the error of each run, shape (runs,) [m]; run k depends on `seed` and k only.

    `first`: see `follow`. `progress` is called after each run."""
    found = []
    for run in range(runs):
        found.append(follow(build, path, detections, np.random.default_rng((seed, run)), first=first).error_m)
        progress()
    return np.array(found)


def follow(build: Build, path: Path, detections: int, rng: np.random.Generator, *, first: int = 1) -> Followed:
    """Run one filter; the first `first` detections, one T_s apart, count as one. ValueError for a bad `detections`."""
    if not 1 <= detections <= INSTANTS:
        raise ValueError(f"detections={detections}: expected 1 to {INSTANTS}")
    seen = {k * INSTANTS // detections for k in range(detections)} | set(range(first))
    noise = sqrt(MEASURED_M2) * rng.standard_normal((INSTANTS, 2))
    inputs = [Inputs(v, omega) for v, omega in zip(path.v.tolist(), path.omega.tolist(), strict=True)]
    estimator = build((float(path.x[0]), float(path.y[0]), float(path.theta[0])), inputs[0], rng)
    expected, told = [], []
    for k, (x, y) in enumerate(zip(path.x.tolist(), path.y.tolist(), strict=True)):
        if k in seen:
            told.append((k * STEP_NS * 1e-9, x + noise[k, 0], y + noise[k, 1]))
            estimator.correct(k * STEP_NS, *told[-1][1:], inputs[k])
        expected.append(estimator.expect(k * STEP_NS))
    places = np.array(expected)
    return Followed(places, np.array(told), np.hypot(places[:, 0] - path.x, places[:, 1] - path.y))
