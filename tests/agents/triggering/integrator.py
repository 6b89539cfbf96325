"""A loop simple enough to know everything about: x' = u, |u| <= 1, e' = -u; for tests of what is not about tracking."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass
class IntegratorPrediction:
    x: float
    rate: float             # growth per unit of |x|
    since_s: float = 0.0
    seen: float = 0.0

    def growth_until(self, tau_s: float) -> float:
        return self.rate * max(self.seen, abs(self.x) + max(tau_s - self.since_s, 0.0))

    def look(self, elapsed_s: float, x: float) -> None:
        self.seen = max(self.seen, abs(self.x) + elapsed_s - self.since_s)
        self.x, self.since_s = x, elapsed_s


@dataclass(frozen=True)
class Integrator:
    """Growth is |x| times the first input; the inputs are at most 2."""

    worst_inputs: tuple[float, ...] = (2.0,)

    def largest_norm(self, x: float) -> float:
        return abs(x)

    def admissible(self, inputs: tuple[float, ...]) -> tuple[float, ...]:
        return (min(inputs[0], 2.0),)

    def predict(self, x: float, inputs: tuple[float, ...], bounded_by: tuple[float, ...]) -> IntegratorPrediction:
        return IntegratorPrediction(x, bounded_by[0])

    def growth_within(self, inputs: tuple[float, ...], radius: float) -> Callable[[float], float]:
        return lambda tau_s: inputs[0] * (radius + tau_s)
