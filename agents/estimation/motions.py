"""Motion of a target along its curve: arc length, speed and acceleration at its newest detection.

Each member computes a `Motion` from the arc lengths s_1 .. s_n of all detections in the window, at t_1 .. t_n:

    mean            speed (s_n - s_1) / (t_n - t_1) from s_n on
    last_sign       the same in the direction of the last interval: better after a reversal, worse in noise
    line            least-squares line through the speeds of the intervals (at their middles), extrapolated to t_n;
                    its slope is the acceleration
    smoothed        least-squares line through the arc lengths: its value at t_n in place of s_n, its slope the speed

Every speed is clipped to [-v_max, v_max], at t_n and at all later times.

Differs from the dissertation, which prints `line`: with few intervals its slope is mostly noise, and over gaps of
seconds the extrapolation diverges. `mean` gives the printed errors; `smoothed` gives smaller ones if noise dominates.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import copysign
from typing import NamedTuple


class Motion(NamedTuple):
    s_m: float                  # arc length at t_n
    v_mps: float                # clipped
    a_mps2: float
    v_max_mps: float

    def way_m(self, dt_s: float) -> float:
        """Return the arc length covered from t_n to t_n + dt: the integral of the clipped speed."""
        v, a = self.v_mps, self.a_mps2
        if not a:
            return v * dt_s
        end = copysign(self.v_max_mps, a)
        ramp_s = (end - v) / a              # >= 0: v is clipped
        if dt_s <= ramp_s:
            return (v + 0.5 * a * dt_s) * dt_s
        return 0.5 * (v + end) * ramp_s + end * (dt_s - ramp_s)


MotionRule = Callable[[Sequence[float], Sequence[float], float], Motion]


def mean(times_s: Sequence[float], lengths_m: Sequence[float], v_max_mps: float) -> Motion:
    v = (lengths_m[-1] - lengths_m[0]) / (times_s[-1] - times_s[0])
    return Motion(lengths_m[-1], _clipped(v, v_max_mps), 0.0, v_max_mps)


def last_sign(times_s: Sequence[float], lengths_m: Sequence[float], v_max_mps: float) -> Motion:
    motion = mean(times_s, lengths_m, v_max_mps)
    return motion._replace(v_mps=copysign(motion.v_mps, lengths_m[-1] - lengths_m[-2]))


def line(times_s: Sequence[float], lengths_m: Sequence[float], v_max_mps: float) -> Motion:
    pairs = range(len(times_s) - 1)
    speeds = [(lengths_m[i + 1] - lengths_m[i]) / (times_s[i + 1] - times_s[i]) for i in pairs]
    middles = [0.5 * (times_s[i + 1] + times_s[i]) for i in pairs]
    v, a = _line_at(times_s[-1], middles, speeds)
    return Motion(lengths_m[-1], _clipped(v, v_max_mps), a, v_max_mps)


def smoothed(times_s: Sequence[float], lengths_m: Sequence[float], v_max_mps: float) -> Motion:
    s, v = _line_at(times_s[-1], times_s, lengths_m)
    return Motion(s, _clipped(v, v_max_mps), 0.0, v_max_mps)


MOTIONS: dict[str, MotionRule] = {"mean": mean, "last_sign": last_sign, "line": line, "smoothed": smoothed}


def _line_at(at: float, xs: Sequence[float], ys: Sequence[float]) -> tuple[float, float]:
    """Return value at `at` and slope of the least-squares line through at least 2 points of different x."""
    n = len(xs)
    mean_x, mean_y = sum(xs) / n, sum(ys) / n
    sxx = sxy = 0.0
    for x, y in zip(xs, ys, strict=True):
        sxx += (x - mean_x) ** 2
        sxy += (x - mean_x) * (y - mean_y)
    slope = sxy / sxx
    return mean_y + slope * (at - mean_x), slope


def _clipped(v: float, v_max: float) -> float:
    return max(-v_max, min(v_max, v))
