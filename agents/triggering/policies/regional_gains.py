"""Individual gains that count in a region |x| <= r alone, where they are far smaller; outside it the global ones.

    gamma_n = the regional gain of the inputs      if every state that can be measured as x^ has |x| <= r
              the gain of `IndividualGains`        otherwise

A gain counts in a region if it is for inputs (e, e_omega) of a bounded norm, which reach these states alone. A robot
sees the region, not the norm. The states predicted within tau_i may leave the region: then the next measurement shows
that the assumption did not hold (`assumptions.region_violations`), and the policy falls back to the global gain.
"""

from __future__ import annotations

from agents.triggering.error_system import Prediction
from agents.triggering.gain_table import RegionalGain
from agents.triggering.policies import Decision
from agents.triggering.policies.input_output import IndividualGains, W, X


class RegionalGains(IndividualGains[X, W]):
    def decide(self, measured_ns: int, x: X, inputs: W) -> Decision:
        decided, regional = super().decide(measured_ns, x, inputs), self._regional(x, inputs)
        self.last = decided if regional is None else decided._replace(radius=regional.radius)
        return self.last

    def predict(self, x: X, inputs: W) -> tuple[float, Prediction[X]]:
        gain_per_s, prediction = super().predict(x, inputs)
        regional = self._regional(x, inputs)
        return gain_per_s if regional is None else regional.gain_per_s, prediction

    def _regional(self, x: X, inputs: W) -> RegionalGain | None:
        """Return the gain that counts in a region in which the state is, whatever the noise; None if there is none."""
        found = self.gains.regional(self.system.admissible(inputs))
        return found if found is not None and self.system.largest_norm(x) <= found.radius else None
