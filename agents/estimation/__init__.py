"""Estimation of a target's motion from detections at irregular times (Chapter 3 of the dissertation).

A member of this kind is an estimator: the caller gives it detections with time stamps and asks for positions.

    expect(t_ns)                     -> position (x, y) [m] expected at t, not before the newest detection accepted
    correct(t_ns, x_m, y_m, inputs)  -> True if the detection was accepted, False if it came too late

`inputs` are the target's velocities (v [m/s], omega [rad/s]) at the detection, held until the next one; if they are
unknown (None), the last known ones are held. `CircleFilter` ignores them.

Times are those of the caller's clock. A detection that is newer than all accepted ones is accepted, whatever its delay.
An older one is inserted by `CircleFilter` if it lies within its window; the other estimators reject it, unless
`Replayed` wraps them. `UnknownInputs` and `PredictedPath` make them fit for robots, which are told no inputs.
`agents.pursuit` decides when to look.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

FARTHEST_M = 1e9                # largest coordinate accepted; its fourth power is a finite float


class Inputs(NamedTuple):
    v_mps: float
    omega_radps: float


class Estimator(Protocol):
    def expect(self, t_ns: int) -> tuple[float, float]: ...

    def correct(self, t_ns: int, x_m: float, y_m: float, inputs: Inputs | None = None) -> bool: ...


class Order:
    """The checks of detections and of requested times that all estimators share."""

    def __init__(self) -> None:
        self.last_ns: int | None = None     # time stamp of the newest detection accepted

    def accepts(self, t_ns: int, x_m: float, y_m: float) -> bool:
        """Return whether the detection is the newest; ValueError if it is not finite or repeats a time stamp."""
        if not (abs(x_m) <= FARTHEST_M and abs(y_m) <= FARTHEST_M):
            raise ValueError(f"detection ({x_m}, {y_m}) m at {t_ns} ns: expected finite numbers, at most "
                             f"{FARTHEST_M:g} in size; leave it out")
        if t_ns == self.last_ns:
            raise ValueError(f"detection at {t_ns} ns: there is one with this time stamp already; keep one of them")
        return self.last_ns is None or t_ns > self.last_ns

    def check_question(self, t_ns: int, reached_ns: int) -> None:
        if t_ns < reached_ns:
            raise ValueError(f"expected position at {t_ns} ns: the filter is at {reached_ns} ns already; ask in order")
