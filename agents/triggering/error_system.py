"""The interface by which a control loop describes itself to a trigger; the tracking robots' is in `agents.tracking`.

States x and inputs omega_p are opaque to the trigger; X and W are their types.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

X = TypeVar("X", contravariant=True)
W = TypeVar("W")
Measured = TypeVar("Measured", contravariant=True)


class Prediction(Protocol[Measured]):
    """The prediction from one measurement while the command computed from it is held."""

    def growth_until(self, tau_s: float) -> float:
        """Return the ||A|| [1/s] of (4.25) that is valid over [0, tau_s] after the measurement."""

    def look(self, elapsed_s: float, x: Measured) -> None:
        """Predict from x, measured `elapsed_s` after the first measurement; the growth until then is kept."""


class ErrorSystem(Protocol[X, W]):
    @property
    def worst_inputs(self) -> W:
        """The inputs of P with the largest matrix A."""

    def largest_norm(self, x: X) -> float:
        """Return the largest |x| of a state that can be measured as x."""

    def admissible(self, inputs: W) -> W:
        """Return the inputs of P nearest to `inputs`; ValueError if these are not numbers."""

    def predict(self, x: X, inputs: W, bounded_by: W) -> Prediction[X]:
        """Predict from a measurement x, with the command of x and `inputs` held and the matrix A of `bounded_by`.

        Raises ValueError if x is no measurement.
        """

    def growth_within(self, inputs: W, radius: float) -> Callable[[float], float]:
        """Return tau [s] -> ||A|| [1/s] over [0, tau], valid for any measurement of a state with |x| <= radius."""
