"""Wraps a policy for looks that take a constant time d: the small-gain condition is one over the age of information.

    s_i         request i      s_i + d     its command acts      s_(i+1) + d     the next one acts: the age is largest

A command acts from s_i + d to s_(i+1) + d, when its measurement is s_(i+1) - s_i + d old. So (4.37) over the age leaves
the interval tau_i - d, shared among N^D + 1 requests. It may be shorter than d: then requests overlap.

Where less than `floor_ns`, the time of a request and its answer on the air, is left, there is no such interval: the
policy's own is kept, and the age exceeds tau_i.

Differs from the dissertation: Remark 7 refers to scattering, which does not apply here (docs/models/tracking.md).
"""

from __future__ import annotations

from typing import Generic

from agents.triggering.policies import Decision, Policy
from agents.triggering.policies.input_output import W, X


class Delayed(Generic[X, W]):
    def __init__(self, inner: Policy[X, W], delay_ns: int, floor_ns: int = 1) -> None:
        if delay_ns < 0 or floor_ns < 1:
            raise ValueError(f"delay_ns={delay_ns}, floor_ns={floor_ns}: expected at least 0 and 1")
        self.inner, self.delay_ns, self.floor_ns = inner, delay_ns, floor_ns

    @property
    def watch_ns(self) -> int:
        return self.inner.watch_ns

    def decide(self, measured_ns: int, x: X, inputs: W) -> Decision:
        return self._shortened(self.inner.decide(measured_ns, x, inputs))

    def look(self, now_ns: int, x: X) -> Decision:
        return self._shortened(self.inner.look(now_ns, x))

    def _shortened(self, decided: Decision) -> Decision:
        requests = max(decided.losses_allowed, 0) + 1
        left_ns = (decided.valid_ns - self.delay_ns) // requests
        interval_ns = min(decided.interval_ns, left_ns) if left_ns >= self.floor_ns else decided.interval_ns
        return decided._replace(interval_ns=interval_ns, delay_ns=self.delay_ns)
