"""Table 3.5: computing time of one step, a prediction to the next instant and a correction there, on this machine.

A value is the mean over a round of 500 steps, in the fastest of all rounds, since other work on the machine only adds
time. The circle filter repeats its fit at every step (rho = 0), with Gamma = 17; the particle filter has 1000
particles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from time import perf_counter

import numpy as np

from agents.estimation import Estimator, Inputs
from agents.estimation.circle_filter import CircleFilter
from agents.estimation.monte_carlo import FILTERS
from agents.estimation.paths import STEP_NS
from experiments.show.tables import Measured, Row

STEPS = 500
SPEED_MPS, SIGMA_M = 0.5, 0.1
Round = Callable[[], float]             # runs a round; mean time of a step [s]


class StepTime:
    title = "Table 3.5: running time per step on this machine, the fastest of rounds of 500 steps"
    judged_by = "Judged by limits on this machine's time; the printed times are another machine's."
    runs = 20                           # rounds

    def steps(self, runs: int) -> int:
        return runs * len(ROWS)

    def measure(self, runs: int, progress: Callable[[], None]) -> Iterator[Measured]:
        for row, make in ROWS:
            one = make()
            if one is None:
                for _ in range(runs):
                    progress()
                yield Measured(row, None, None, runs)
                continue
            found = []
            for _ in range(runs):
                found.append(one() * 1e6)
                progress()
            yield Measured(row, min(found), None, runs)


def _detections() -> list[tuple[int, float, float]]:
    noise = SIGMA_M * np.random.default_rng(1).standard_normal((STEPS, 2))
    return [(k * STEP_NS, SPEED_MPS * k * STEP_NS * 1e-9 + dx, dy)
            for k, (dx, dy) in enumerate(noise.tolist(), 1)]


def _corrections(build: Callable[[], Estimator]) -> Round:
    detections, inputs = _detections(), Inputs(SPEED_MPS, 0.1)

    def one() -> float:
        estimator = build()
        began_s = perf_counter()
        for t_ns, x, y in detections:
            estimator.correct(t_ns, x, y, inputs)
        return (perf_counter() - began_s) / STEPS

    return one


def _refits() -> Round:
    return _corrections(lambda: CircleFilter(17, rho_m=0.0))


def _predictions() -> Round:
    estimator = CircleFilter(17, rho_m=0.0)
    for t_ns, x, y in _detections():
        estimator.correct(t_ns, x, y)

    def one() -> float:
        began_s = perf_counter()
        for k in range(STEPS, 2 * STEPS):
            estimator.expect(k * STEP_NS)
        return (perf_counter() - began_s) / STEPS

    return one


def _filter(name: str) -> Callable[[], Round]:
    return lambda: _corrections(lambda: FILTERS[name]((0.0, 0.0, 0.0), Inputs(SPEED_MPS, 0.1),
                                                      np.random.default_rng(1)))


def _peer() -> Round | None:
    """Return a round of filterpy's unscented filter with the same model, None if it is not installed."""
    try:
        from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter
    except ImportError:
        return None
    dt_s, detections = STEP_NS * 1e-9, [np.array(detection[1:]) for detection in _detections()]

    def moved(state: np.ndarray, dt: float) -> np.ndarray:
        way = dt * SPEED_MPS
        return np.array([state[0] + way * np.cos(state[2]), state[1] + way * np.sin(state[2]), state[2] + dt * 0.1])

    def one() -> float:
        points = MerweScaledSigmaPoints(3, 1.0, 2.0, 0.0)
        peer = UnscentedKalmanFilter(3, 2, dt_s, lambda state: state[:2], moved, points)
        peer.P, peer.Q, peer.R = np.diag([0.01, 0.01, 0.49]), 0.01 * np.eye(3), 0.01 * np.eye(2)
        began_s = perf_counter()
        for detection in detections:
            peer.predict()
            peer.update(detection)
        return (perf_counter() - began_s) / STEPS

    return one


ROWS: list[tuple[Row, Callable[[], Round | None]]] = [
    (Row("UKF", "time", "us", 490.0, 1.7e-8 * 1e12, high=30.0), _filter("UKF")),
    (Row("SIR PF, 1000 particles", "time", "us", 9800.0, 5.6e-7 * 1e12, high=90.0), _filter("PF")),
    (Row("circle filter, Gamma = 17", "time", "us", 3500.0, 4.3e-7 * 1e12, high=60.0), _refits),
    (Row("circle filter, prediction alone", "time", "us", None, high=2.0), _predictions),
    (Row("filterpy's UKF", "time", "us", None), _peer)]
