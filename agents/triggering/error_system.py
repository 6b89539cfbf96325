"""What a control loop has to tell a trigger. `agents.tracking.error_system` is the one of the tracking robots.

States x and inputs omega_p are opaque to the trigger; X and W are their types.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

X = TypeVar("X", contravariant=True)
W = TypeVar("W")
Measured = TypeVar("Measured", contravariant=True)


class Prediction(Protocol[Measured]):
    """What follows from one measurement while the command computed from it is held."""

    def growth_until(self, tau_s: float) -> float:
        """||A|| [1/s] that holds over [0, tau_s] after the measurement: (4.25) on the set reachable until then."""
        ...

    def look(self, elapsed_s: float, x: Measured) -> None:
        """x was measured `elapsed_s` after: from here on predict from it, beside what has been seen."""
        ...


class ErrorSystem(Protocol[X, W]):
    @property
    def worst_inputs(self) -> W:
        """The inputs of P with the largest bound A."""
        ...

    def admissible(self, inputs: W) -> W:
        """The nearest inputs of P; ValueError for what is not a number."""
        ...

    def predict(self, x: X, inputs: W, bounded_by: W) -> Prediction[X]:
        """From a measurement x, the command of x and `inputs` held, with the matrix A of `bounded_by`.

        ValueError for what is not a measurement.
        """
        ...

    def growth_within(self, inputs: W, radius: float) -> Callable[[float], float]:
        """tau -> ||A|| [1/s] that holds from every measurement of a state with |x| <= radius."""
        ...
