"""Event triggering: frequent evaluation of the condition that input-output triggering predicts.

Between transmissions the state is measured every `watch_ns` without being sent. Each such look restarts the
prediction: A is valid for the states predicted until now and for those reachable from the state measured now. An
interval still ends before gamma_n gamma_e exceeds kappa, and never earlier than `inner` would end it. Each look costs
one evaluation of the trigger.
"""

from __future__ import annotations

from typing import Generic

from agents.triggering.error_gain import largest_horizon
from agents.triggering.error_system import Prediction
from agents.triggering.policies import Decision
from agents.triggering.policies.input_output import IndividualGains, W, X, decision

MS = 1_000_000


class EventTriggered(Generic[X, W]):
    def __init__(self, inner: IndividualGains[X, W], watch_ns: int = MS) -> None:
        if watch_ns < 1:
            raise ValueError(f"watch_ns={watch_ns}: expected 1 or more between two looks")
        self.inner, self.watch_ns = inner, watch_ns
        self._gain_per_s = 0.0
        self._prediction: Prediction[X] | None = None
        self.last: Decision | None = None

    def decide(self, measured_ns: int, x: X, inputs: W) -> Decision:
        self._gain_per_s, self._prediction = self.inner.predict(x, inputs)
        self.last = self._decide(measured_ns, self._prediction)
        return self.last

    def look(self, now_ns: int, x: X) -> Decision:
        assert self.last is not None, "look before decide"
        assert self._prediction is not None
        self._prediction.look((now_ns - self.last.measured_ns) * 1e-9, x)
        seen = self._decide(self.last.measured_ns, self._prediction)
        if seen.valid_ns > self.last.valid_ns:
            self.last = seen
        return self.last

    def _decide(self, measured_ns: int, prediction: Prediction[X]) -> Decision:
        horizon = largest_horizon(prediction.growth_until, self._gain_per_s, self.inner.kappa)
        return decision(measured_ns, horizon, self._gain_per_s)
