"""Computes the values that a robot broadcasts in its slot: its outputs as measured, as its observer estimates them, or,
if the others run its model, the estimated state and the sum of its neighbours' outputs.

    y -> + noise -> observer -> C xh, or (xh, s) of `model_hold`
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from agents.synchronization.measurement_noise import MeasurementNoise
from agents.synchronization.model_hold import ModelHold
from agents.synchronization.observer import Observer
from agents.synchronization.team import Model

Outputs = tuple[float, ...]


class OwnValues:
    def __init__(self, read: Callable[[], Outputs], noise: MeasurementNoise | None, model: Model, now_ns: int) -> None:
        self._read, self._noise = read, noise
        self.observer = (Observer(model.agent, model.observer_poles, model.observer_start.tolist(), now_ns)
                         if model.observer_poles else None)

    def measure(self, now_ns: int) -> Outputs:
        """Return y as measured, with an observer as observed; each call draws the noise of one measurement."""
        measured = self._read()
        if self._noise is not None:
            measured = self._noise.of(measured)
        if self.observer is None:
            return measured
        self.observer.correct(now_ns, measured)
        return self.observer.output_at(now_ns)

    def measure_for(self, models: ModelHold, now_ns: int, count: int) -> Outputs:
        """Return the numbers of a frame from which others run this robot's model."""
        assert self.observer is not None            # `read_team` requires it
        self.measure(now_ns)
        return models.frame_values(now_ns, self.observer.estimate, count)

    def expect_rounds_of(self, round_ns: int) -> None:
        if self.observer is not None:
            self.observer.expect_corrections_every(round_ns)

    def drive(self, now_ns: int, control: Sequence[float]) -> None:
        """Take the input that acts from now on, without the disturbance, which no robot knows."""
        if self.observer is not None:
            self.observer.set_input(now_ns, control)
