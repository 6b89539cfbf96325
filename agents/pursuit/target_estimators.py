"""The estimators of a pursuing robot, which detects its target and knows nothing else of it.

    circle      `CircleFilter`
    ukf         `UnscentedKalman`    } beside a circle filter that supplies the target's inputs (`UnknownInputs`);
    particle    `ParticleFilter`     } detections out of order are applied in order (`Replayed`)

The looks that the no-escape theorem asks for depend on detections alone, so it holds with each of them; an estimator
decides about the looks that follow a surprise.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from random import Random
from typing import NamedTuple

from agents.estimation import Estimator, Inputs
from agents.estimation.circle_filter import CircleFilter
from agents.estimation.predicted_path import PredictedPath
from agents.estimation.replayed import Replayed
from agents.estimation.unknown_inputs import UnknownInputs
from agents.estimation.unscented_kalman import Tuning, UnscentedKalman

HEADING_RAD2 = 0.7 ** 2         # variance of the heading when a filter starts, as in the tables


class Known(NamedTuple):
    """Limits of the target's motion and variances of the sensor, from which a pursuing robot builds its filter."""

    window: int                 # Gamma, number of detections in the circle filter
    rho_m: float
    v_max_mps: float
    sigma_m: float
    step_ns: int                # T_s
    process_m2: float           # Q = process_m2 I [m2, m2, rad2]: of ukf once per detection, of particle every T_s
    particles: int

    @property
    def start_variances(self) -> tuple[float, float, float]:
        return self.sigma_m ** 2, self.sigma_m ** 2, HEADING_RAD2


State = tuple[float, float, float]


def circle(known: Known, rng: Random) -> CircleFilter:
    return CircleFilter(known.window, rho_m=known.rho_m, v_max_mps=known.v_max_mps, sigma_m=known.sigma_m)


def ukf(known: Known, rng: Random) -> Estimator:
    _check(known)
    return Replayed(UnknownInputs(circle(known, rng), partial(_start_ukf, known)))


def particle(known: Known, rng: Random) -> Estimator:
    """Return a particle filter; its seed is drawn from `rng` now, so that its draws are the same in every replay."""
    _check(known)
    if known.particles < 2:
        raise ValueError(f"particles={known.particles}: expected at least 2")
    return Replayed(UnknownInputs(circle(known, rng), partial(_start_particle, known, rng.getrandbits(64))))


ESTIMATORS: dict[str, Callable[[Known, Random], Estimator]] = {"circle": circle, "ukf": ukf, "particle": particle}


def target_estimator(name: str, known: Known, rng: Random) -> Estimator:
    """Return a new estimator; ValueError for an unknown name and for numbers that it cannot work with."""
    if name not in ESTIMATORS:
        raise ValueError(f"estimator={name!r}: expected one of {', '.join(ESTIMATORS)}")
    return ESTIMATORS[name](known, rng)


def _check(known: Known) -> None:
    if not known.sigma_m > 0:
        raise ValueError(f"sigma_m={known.sigma_m}: a Bayesian filter needs a noise of more than 0; take the "
                         "estimator circle for detections without noise")
    if not known.process_m2 >= 0:
        raise ValueError(f"process_m2={known.process_m2}: expected 0 or more")


def _start_ukf(known: Known, t_ns: int, state: State, inputs: Inputs) -> Estimator:
    tuning = Tuning(process_m2=known.process_m2, measured_m2=known.sigma_m ** 2)
    return UnscentedKalman(state, known.start_variances, t_ns, inputs, tuning)


def _start_particle(known: Known, seed: int, t_ns: int, state: State, inputs: Inputs) -> Estimator:
    import numpy as np  # late: a scenario's check builds estimators and starts none

    from agents.estimation.particle_filter import ParticleFilter

    return PredictedPath(ParticleFilter(
        state, known.start_variances, np.random.default_rng(seed), t_ns, inputs, particles=known.particles,
        step_ns=known.step_ns, process_m2=known.process_m2, measured_m2=known.sigma_m ** 2), t_ns, known.step_ns)
