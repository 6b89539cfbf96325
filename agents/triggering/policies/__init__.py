"""Policies: when is the next measurement due, given the one taken now?

A member of this kind has one verb, `decide`: from a measurement and the inputs known with it to a `Decision`. Policies
with `watch_ns` > 0 also want to look at the state in between, every `watch_ns`, without a transmission; `look` then
returns the decision as it stands. What a decision rests on is checked by `agents.triggering.assumptions`.

All times are those of the caller's clock, in nanoseconds.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol, TypeVar

from agents.triggering.error_gain import error_gain

X = TypeVar("X", contravariant=True)
W = TypeVar("W", contravariant=True)


class Decision(NamedTuple):
    measured_ns: int        # t_i: when the state was measured, not when the news arrived
    interval_ns: int        # ask again this long after; and, unanswered, again and again at this interval
    valid_ns: int           # tau_i: the small-gain condition is certified until this long after
    gain_per_s: float       # gamma_n that it was certified with
    growth_per_s: float     # ||A|| that holds over [t_i, t_i + tau_i]

    @property
    def next_ns(self) -> int:
        return self.measured_ns + self.interval_ns

    @property
    def holds_until_ns(self) -> int:
        return self.measured_ns + self.valid_ns

    @property
    def losses_allowed(self) -> int:
        """How many attempts in a row may fail so that the one after them is still in time."""
        return self.valid_ns // self.interval_ns - 1

    def attempt_ns(self, failed: int) -> int:
        """When to ask again after that many attempts have failed."""
        return self.measured_ns + (failed + 1) * self.interval_ns

    def gain_product(self, now_ns: int) -> float:
        """gamma_n gamma_e(now - t_i): at most kappa while the decision holds; below 1 is what Theorem 4 needs."""
        return self.gain_per_s * error_gain(self.growth_per_s, max(now_ns - self.measured_ns, 0) * 1e-9)


class Policy(Protocol[X, W]):
    @property
    def watch_ns(self) -> int:
        """How often `look` wants to be called between measurements; 0 for never."""
        ...

    def decide(self, measured_ns: int, x: X, inputs: W) -> Decision:
        """ValueError if x or inputs are no measurement (not finite, or absurdly large)."""
        ...

    def look(self, now_ns: int, x: X) -> Decision:
        """The last decision, prolonged by what a look at the state now allows; never shortened."""
        ...
