"""Input-output triggering: tau_i from the measured state and inputs, (4.37).

`IndividualGains` uses the gain and the matrix A of the inputs measured now, `UnifiedGain` the largest gain Z of all
inputs and the matrix of the worst ones, whatever was measured.

Not modelled: intervals below 1 us; gains that would require them raise ValueError.
"""

from __future__ import annotations

from typing import Generic, TypeVar

from agents.triggering.error_gain import KAPPA, Horizon, largest_horizon
from agents.triggering.error_system import ErrorSystem, Prediction
from agents.triggering.gain_table import GainTable
from agents.triggering.policies import Decision

SHORTEST_S = 1e-6

X = TypeVar("X")
W = TypeVar("W", bound=tuple[float, ...])


class IndividualGains(Generic[X, W]):
    watch_ns = 0

    def __init__(self, system: ErrorSystem[X, W], gains: GainTable, kappa: float = KAPPA) -> None:
        if not 0 < kappa < 1:
            raise ValueError(f"kappa={kappa}: expected 0 < kappa < 1, the product of gains must stay below 1")
        self.system, self.gains, self.kappa = system, gains, kappa
        self.last: Decision | None = None
        shortest_s = self.shortest_s(0.0)
        if shortest_s < SHORTEST_S:
            raise ValueError(f"the gain {gains.unified:g} 1/s makes the horizon {shortest_s:.3g} s even at rest: "
                             f"expected at least {SHORTEST_S:g} s, no link and no robot is faster; lower the gain")

    def decide(self, measured_ns: int, x: X, inputs: W) -> Decision:
        gain_per_s, prediction = self.predict(x, inputs)
        self.last = decision(measured_ns, largest_horizon(prediction.growth_until, gain_per_s, self.kappa), gain_per_s)
        return self.last

    def look(self, now_ns: int, x: X) -> Decision:
        assert self.last is not None, "look before decide"
        return self.last

    def predict(self, x: X, inputs: W) -> tuple[float, Prediction[X]]:
        """Return gamma_n and the prediction from the measurement."""
        inputs = self.system.admissible(inputs)
        return self.gains.gain(inputs), self.system.predict(x, inputs, inputs)

    def shortest_s(self, radius: float) -> float:
        """Return a lower bound of all horizons [s] with |x| <= radius (Remark 4 with Z, V): no Zeno behaviour."""
        growth_until = self.system.growth_within(self.system.worst_inputs, radius)
        return largest_horizon(growth_until, self.gains.unified, self.kappa).tau_s


class UnifiedGain(IndividualGains[X, W]):
    def predict(self, x: X, inputs: W) -> tuple[float, Prediction[X]]:
        return self.gains.unified, self.system.predict(x, self.system.admissible(inputs), self.system.worst_inputs)


def decision(measured_ns: int, horizon: Horizon, gain_per_s: float) -> Decision:
    """Return the decision for `horizon`, rounded down to whole nanoseconds."""
    tau_ns = max(int(horizon.tau_s * 1e9), 1)
    return Decision(measured_ns, tau_ns, tau_ns, gain_per_s, horizon.growth_per_s)
