"""Estimates a target, a unicycle with unknown inputs v [m/s], omega [rad/s]: a circle filter reads them off its path.

    detection --> circle filter (`CircleFilter`)    its first curve starts the filter: place, tangent as the heading
              |     v = +-speed, omega = speed curvature    of the curve, after this detection
              --> filter, with (v, omega) as inputs, held until the next detection

The curve points along the motion, the heading along the robot. v changes its sign when the curve turns by more than a
quarter of a turn from one detection to the next, since then the target has reversed.

Until the circle filter has a curve, from the third detection on, the expected place is the newest detection.
Differs from the dissertation, whose UKF and particle filter are told the target's inputs and its initial state; it
remarks that "such knowledge is rarely available" (Chapter 3).
Not modelled: a target that drives backwards at its first detections; its heading is then off by half a turn, and so is
the sign of v, which together are the same motion.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos

from agents.estimation import Estimator, Inputs
from agents.estimation.circle_filter import CircleFilter

Start = Callable[[int, tuple[float, float, float], Inputs], Estimator]     # (t [ns], (x, y, theta) [m, m, rad], inputs)


class UnknownInputs:
    def __init__(self, circle: CircleFilter, start: Start) -> None:
        self._circle, self._start = circle, start
        self._filter: Estimator | None = None
        self._sign = 1                                  # of v

    def expect(self, t_ns: int) -> tuple[float, float]:
        return self._circle.expect(t_ns) if self._filter is None else self._filter.expect(t_ns)

    def correct(self, t_ns: int, x_m: float, y_m: float, inputs: Inputs | None = None) -> bool:
        """Apply a detection, the newest one; inputs that are told replace those of the circle filter."""
        before_rad = self._heading_rad(t_ns)
        if not self._circle.correct(t_ns, x_m, y_m):
            return False
        heading_rad, curve = self._heading_rad(t_ns), self._circle.curve
        if heading_rad is None or curve is None:
            return True
        if before_rad is not None and cos(heading_rad - before_rad) < 0:
            self._sign = -self._sign
        speed_mps = self._circle.motion.v_mps
        read = Inputs(self._sign * speed_mps, speed_mps * curve.k_per_m) if inputs is None else inputs
        if self._filter is not None:
            return self._filter.correct(t_ns, x_m, y_m, read)
        self._filter = self._start(t_ns, (*self._circle.expect(t_ns), heading_rad), read)
        return True

    def _heading_rad(self, t_ns: int) -> float | None:
        """Return the direction of the curve at t, None without a curve."""
        circle = self._circle
        if circle.curve is None:
            return None
        return circle.curve.heading_rad(circle.motion.way_m((t_ns - circle.fitted_ns) * 1e-9))
