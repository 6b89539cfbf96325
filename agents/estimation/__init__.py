"""Estimation of a target's motion from detections that come now and then (Chapter 3 of the dissertation).

A member of this kind is told detections with their time stamps and asked where the target is:

    expect(t_ns)                     -> position (x, y) [m] expected at t, not before the newest detection that counted
    correct(t_ns, x_m, y_m, inputs)  -> True if it counted, False if it came too late for this member

`inputs` are the target's velocities (v [m/s], omega [rad/s]) at the detection, held until the next one; where they are
not known (None), the last known ones are held. `CircleFilter` does without.

Times are those of the caller's clock. A detection counts however much later it comes than it was made, as long as it
is newer than the newest one that counted; an older one is put into its place in time by `CircleFilter`, while it is in
reach of its window, and left out by the others unless `Replayed` goes back for it. Whether and when to look is decided
by `agents.pursuit`, for all alike.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

FARTHEST_M = 1e9                # detections beyond are none; squares of squares of what is left are finite


class Inputs(NamedTuple):
    v_mps: float
    omega_radps: float


class Estimator(Protocol):
    def expect(self, t_ns: int) -> tuple[float, float]: ...

    def correct(self, t_ns: int, x_m: float, y_m: float, inputs: Inputs | None = None) -> bool: ...


class Order:
    """Time stamps of detections and of questions: what every estimator refuses."""

    def __init__(self) -> None:
        self.last_ns: int | None = None     # of the newest detection that counted

    def accepts(self, t_ns: int, x_m: float, y_m: float) -> bool:
        """Whether it is the newest; ValueError for one that is no number or has the time stamp of the newest so far."""
        if not (abs(x_m) <= FARTHEST_M and abs(y_m) <= FARTHEST_M):
            raise ValueError(f"detection ({x_m}, {y_m}) m at {t_ns} ns: expected finite numbers, at most "
                             f"{FARTHEST_M:g} in size; leave it out")
        if t_ns == self.last_ns:
            raise ValueError(f"detection at {t_ns} ns: there is one with this time stamp already; keep one of them")
        return self.last_ns is None or t_ns > self.last_ns

    def check_question(self, t_ns: int, reached_ns: int) -> None:
        if t_ns < reached_ns:
            raise ValueError(f"expected position at {t_ns} ns: the filter is at {reached_ns} ns already; ask in order")
