"""Noise of the outputs that a robot measures in its slots, nu of (4.40), of a declared level.

    uniform     in [-level, level] in each component, as in section 4.6
    gaussian    normal with standard deviation `level`, without a bound

Drawn from the robot's random stream, one number for each output and measurement.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from random import Random
from typing import Final

from netem.impairments.correlated_uniforms import SMALLEST, normal_quantile


def _uniform(u: float) -> float:
    return 2 * u - 1


def _gaussian(u: float) -> float:
    return normal_quantile(u or SMALLEST)


NOISES: Final[dict[str, Callable[[float], float]]] = {"uniform": _uniform, "gaussian": _gaussian}


class MeasurementNoise:
    def __init__(self, rng: Random, kind: str, level: float) -> None:
        self._rng, self._level, self._quantile = rng, level, NOISES[kind]

    def of(self, outputs: Sequence[float]) -> tuple[float, ...]:
        """Return the outputs as measured."""
        return tuple(value + self._level * self._quantile(self._rng.random()) for value in outputs)
