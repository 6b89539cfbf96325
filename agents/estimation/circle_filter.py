"""Prediction and correction on a circle, or a line, through the last Gamma detections (section 3.2).

    predict     p(s_n + way(t - t_n))       p: the curve, s_n: arc length of its newest detection, way: see `motions`
    correct     the detection joins the window, the oldest leaves it. If |y - prediction| < rho the fit stays. Else
                    curve       Pratt's circle if RSS_line - RSS_circle >= 9 sigma^2, else the line
                    s_1 .. s_n  feet of the window's detections on it, each within half a turn of the one before
                    speed       from all (t_i, s_i), clipped to v_max
                and the curve is reversed if the speed along it is negative.

Half a turn: a foot on a circle has many arc lengths, one turn apart; the filter takes the one nearest to s_(i-1). If a
turn is longer than 2 v_max dt, that is the only one with |s_i - s_(i-1)| <= v_max dt. For shorter turns it is a guess.

With fewer than three detections, the expected position is the newest detection.

Differs from the dissertation, which always takes the circle: with noise, straight paths then become curves
(`line_gate=False` does so too).
Not modelled: the heading of a target that drives backwards; detections show the direction of travel only.
"""

from __future__ import annotations

from math import hypot, inf, isfinite

from agents.estimation import Inputs, Order
from agents.estimation.circle_fit import fit
from agents.estimation.curve import Curve
from agents.estimation.motions import MOTIONS, Motion

GATE_SIGMAS2 = 9.0              # [sigma^2] the circle's additional parameter alone gains sigma^2 on average
FEWEST = 3


class CircleFilter:
    """Invariants: the window is in order of time, no time twice; `curve` starts where the target was at `fitted_ns`."""

    def __init__(self, window: int = 17, *, rho_m: float = 0.1, v_max_mps: float = 0.7, sigma_m: float = 0.1,
                 line_gate: bool = True, motion: str = "mean") -> None:
        """`window`: Gamma, the number of detections. `sigma_m`: standard deviation of a detection's x and y.
        `v_max_mps`: bound of the target's speed, in either direction. `motion`: a key of `MOTIONS`."""
        if window < FEWEST:
            raise ValueError(f"window={window}: a circle needs Gamma of {FEWEST} detections or more")
        if not (rho_m >= 0 and sigma_m >= 0 and 0 < v_max_mps < inf):
            raise ValueError(f"rho_m={rho_m}, sigma_m={sigma_m}, v_max_mps={v_max_mps}: expected 0 or more, the speed "
                             f"more than 0")
        if motion not in MOTIONS:
            raise ValueError(f"motion={motion!r}: expected one of {', '.join(MOTIONS)}")
        self._size = window
        self._rho_m = rho_m
        self._v_max_mps = v_max_mps
        self._gate_m2 = GATE_SIGMAS2 * sigma_m ** 2 if line_gate else -inf
        self._motion_of = MOTIONS[motion]
        self._window: list[tuple[int, float, float]] = []
        self._order = Order()
        self.curve: Curve | None = None
        self.motion = Motion(0.0, 0.0, 0.0, v_max_mps)
        self.fitted_ns = 0                  # t_n of the fit
        self.kept = self.refitted = 0       # number of corrections that kept the fit, and that changed it

    def expect(self, t_ns: int) -> tuple[float, float]:
        if not self._window:
            raise ValueError(f"expected position at {t_ns} ns: there is no detection yet")
        self._order.check_question(t_ns, self._window[-1][0])
        return self._at(t_ns)

    def correct(self, t_ns: int, x_m: float, y_m: float, inputs: Inputs | None = None) -> bool:
        window = self._window
        newest = self._order.accepts(t_ns, x_m, y_m)
        at = len(window)
        if newest:
            self._order.last_ns = t_ns
        else:
            at = sum(seen_ns < t_ns for seen_ns, _, _ in window)
            if window[at][0] == t_ns:
                raise ValueError(f"detection at {t_ns} ns: there is one with this time stamp already; keep one of them")
            if at == 0 and len(window) == self._size:
                return False
        if self.curve is not None:
            x, y = self._at(t_ns)
            keep = hypot(x_m - x, y_m - y) < self._rho_m
        else:
            keep = False
        window.insert(at, (t_ns, x_m, y_m))
        if len(window) > self._size:
            del window[0]
        if keep:
            self.kept += 1
        elif len(window) >= FEWEST:
            self._refit()
        return True

    def _at(self, t_ns: int) -> tuple[float, float]:
        if self.curve is None:
            return self._window[-1][1:]
        return self.curve.at(self.motion.way_m((t_ns - self.fitted_ns) * 1e-9))

    def _refit(self) -> None:
        points = [(x, y) for _, x, y in self._window]
        found = fit(points)
        curve = found.circle if found.line_rss_m2 - found.circle_rss_m2 >= self._gate_m2 else found.line
        turn_m = curve.turn_m
        last_m = curve.foot_m(*points[0])
        lengths_m = [last_m]
        for x, y in points[1:]:
            foot_m = curve.foot_m(x, y)
            if turn_m < inf:
                foot_m -= turn_m * round((foot_m - last_m) / turn_m)
            lengths_m.append(foot_m)
            last_m = foot_m
        now_ns = self._window[-1][0]
        times_s = [(seen_ns - now_ns) * 1e-9 for seen_ns, _, _ in self._window]
        motion = self._motion_of(times_s, lengths_m, self._v_max_mps)
        curve = curve.moved_to(motion.s_m)
        if motion.v_mps < 0:
            curve, motion = curve.reversed(), motion._replace(v_mps=-motion.v_mps, a_mps2=-motion.a_mps2)
        assert isfinite(motion.v_mps), (motion, self._window)
        self.curve, self.motion, self.fitted_ns = curve, motion, now_ns
        self.refitted += 1
