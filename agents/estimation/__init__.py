"""Estimation of a target's motion from detections that come now and then (Chapter 3 of the dissertation).

A member of this kind is told detections with their time stamps and asked where the target is:

    expect(t_ns)                     -> position (x, y) [m] expected at t, not before the last detection that counted
    correct(t_ns, x_m, y_m, inputs)  -> True if it counted; a detection older than the last one is left out: False

`inputs` are the target's velocities (v [m/s], omega [rad/s]) at the detection, held until the next one.
"""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple, Protocol


class Inputs(NamedTuple):
    v_mps: float
    omega_radps: float


class Estimator(Protocol):
    def expect(self, t_ns: int) -> tuple[float, float]: ...

    def correct(self, t_ns: int, x_m: float, y_m: float, inputs: Inputs) -> bool: ...


class Order:
    """Time stamps of detections and of questions: what every estimator refuses."""

    def __init__(self) -> None:
        self.last_ns: int | None = None     # of the last detection that counted

    def accepts(self, t_ns: int, x_m: float, y_m: float) -> bool:
        """Whether a detection counts; ValueError for one that is no number or has the time stamp of the last one."""
        if not (isfinite(x_m) and isfinite(y_m)):
            raise ValueError(f"detection ({x_m}, {y_m}) m at {t_ns} ns: expected finite numbers; leave it out")
        if t_ns == self.last_ns:
            raise ValueError(f"detection at {t_ns} ns: there is one with this time stamp already; keep one of them")
        return self.last_ns is None or t_ns > self.last_ns

    def check_question(self, t_ns: int, reached_ns: int) -> None:
        if t_ns < reached_ns:
            raise ValueError(f"expected position at {t_ns} ns: the filter is at {reached_ns} ns already; ask in order")
