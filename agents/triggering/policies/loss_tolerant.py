"""Wraps a policy so that up to N^D requests in a row may be lost: one is sent every tau_i / (N^D + 1).

Differs from the dissertation: Remark 6 says tau_i / N^D. With N^D losses in a row, successes are N^D + 1 requests
apart, so by the printed rule the last request is sent at tau_i (N^D + 1) / N^D, too late; N^D = 1 changes nothing.
"""

from __future__ import annotations

from typing import Generic

from agents.triggering.policies import Decision, Policy
from agents.triggering.policies.input_output import W, X


class LossTolerant(Generic[X, W]):
    def __init__(self, inner: Policy[X, W], max_successive_losses: int) -> None:
        if max_successive_losses < 0:
            raise ValueError(f"max_successive_losses={max_successive_losses}: expected 0 or more")
        self.inner, self.max_successive_losses = inner, max_successive_losses

    @property
    def watch_ns(self) -> int:
        return self.inner.watch_ns

    def decide(self, measured_ns: int, x: X, inputs: W) -> Decision:
        return self._shared(self.inner.decide(measured_ns, x, inputs))

    def look(self, now_ns: int, x: X) -> Decision:
        return self._shared(self.inner.look(now_ns, x))

    def _shared(self, decided: Decision) -> Decision:
        interval_ns = min(decided.interval_ns, decided.valid_ns // (self.max_successive_losses + 1))
        return decided._replace(interval_ns=max(interval_ns, 1))
