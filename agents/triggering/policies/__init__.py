"""Policies: a member of this kind decides from a measurement when the next one is due.

`decide` makes a `Decision` from a measurement and the inputs known with it. If `watch_ns` > 0, the caller also measures
the state every `watch_ns` in between, without a transmission, and passes it to `look`, which returns the decision,
possibly prolonged. `agents.triggering.assumptions` checks the assumptions of a decision.

All times are those of the caller's clock, in nanoseconds.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple, Protocol, TypeVar

from agents.triggering.error_gain import error_gain

X = TypeVar("X", contravariant=True)
W = TypeVar("W", contravariant=True)


class Decision(NamedTuple):
    measured_ns: int        # t_i: when the state was measured, not when the measurement arrived
    interval_ns: int        # from t_i to the next request, and between requests without an answer
    valid_ns: int           # tau_i: the small-gain condition is certified over [t_i, t_i + tau_i]
    gain_per_s: float       # gamma_n of the certificate
    growth_per_s: float     # ||A|| of the certificate, valid over [t_i, t_i + tau_i]
    delay_ns: int = 0       # d: from a request to the moment at which the command computed from its answer acts
    radius: float = inf     # largest |x| for which gamma_n counts
    clamped: bool = False   # x was outside of the policy's table and replaced by the nearest state in it

    @property
    def next_ns(self) -> int:
        return self.measured_ns + self.interval_ns

    @property
    def holds_until_ns(self) -> int:
        return self.measured_ns + self.valid_ns

    @property
    def losses_allowed(self) -> int:
        """Number of requests in a row that may fail if the next one still arrives within tau_i."""
        allowed = (self.valid_ns - self.delay_ns) // self.interval_ns - 1
        return max(allowed, 0) if self.delay_ns else allowed

    @property
    def in_time(self) -> bool:
        """Whether the next command acts within tau_i; False if the delay of looks leaves no interval for that."""
        return not self.delay_ns or self.delay_ns + self.interval_ns <= self.valid_ns

    def attempt_ns(self, failed: int) -> int:
        """Return when to send the next request after `failed` requests without an answer."""
        return self.measured_ns + (failed + 1) * self.interval_ns

    def gain_product(self, now_ns: int) -> float:
        """Return gamma_n gamma_e(now - t_i): at most kappa while the decision holds; Theorem 4 requires < 1."""
        return self.gain_per_s * error_gain(self.growth_per_s, max(now_ns - self.measured_ns, 0) * 1e-9)


class Policy(Protocol[X, W]):
    @property
    def watch_ns(self) -> int:
        """Period at which the caller has to call `look` between measurements; 0: never."""

    def decide(self, measured_ns: int, x: X, inputs: W) -> Decision:
        """Return the decision for x, measured at `measured_ns`; ValueError for x or inputs not finite or too large."""

    def look(self, now_ns: int, x: X) -> Decision:
        """Return the last decision, prolonged as far as the present state x allows; never shortened."""
