"""The maneuver across a C-target (section 2.1; Figure 2.3, line 42), and P_R of a sensor that does it.

The sensor moves to and fro orthogonally to the bisector, at distance y ahead of the newest detection, so that its field
of view reaches from one boundary of the C-target to the other and not beyond. Its place is a triangle wave:

    amplitude A(y) = max(0, r c + y / alpha - r)            period 4 A / speed of the sensor

A target with heading phi and speed v is at v t (cos phi, sin phi) from its newest detection. Between two turns of the
sensor the relative motion is a straight line, and its point nearest to the sensor decides. P_R of the sweep is the mean
over phi, uniform within +-pi/2, v, uniform between the limits, and the phase of the sensor, uniform, over POINTS
points of a lattice (quasi-Monte Carlo by additive recurrence, Roberts 2018): exact to about 0.003.

(2.4) uses P_R of a sensor that stands (`detection_probability`); for a place on the bisector both are known, and the
sweep is worth its way only if the sensor is fast enough.

Not modelled: turns of the target, and the walls of the area: the field of view sees beyond them here.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, inf, isfinite, pi

import numpy as np

from agents.marco_polo.c_target import CTarget
from agents.marco_polo.cells import Mask
from agents.marco_polo.sight import Floats

POINTS = 4096
RECURRENCE = 1.324717957244746              # the plastic number, x^3 = x + 1
STANDS = 0.01                               # an amplitude below this share of the radius counts as standing


@dataclass(frozen=True)
class Sweep:
    """A maneuver at `along_m` on the bisector of a C-target; `amplitude_m` is 0 where standing covers the cone."""

    along_m: float
    amplitude_m: float
    speed_mps: float

    @property
    def period_s(self) -> float:
        """Time to and fro; infinite for an amplitude of 0."""
        return 4.0 * self.amplitude_m / self.speed_mps if self.amplitude_m else inf

    def across_m(self, time_s: float) -> float:
        """Return the offset [m] from the bisector, to its right, `time_s` after the sensor passed it rightwards."""
        if not self.amplitude_m:
            return 0.0
        turns = (time_s / self.period_s + 0.25) % 1.0
        return self.amplitude_m * (1.0 - 4.0 * abs(turns - 0.5))


def plan_sweep(target: CTarget, along_m: float, speed_mps: float) -> Sweep:
    """Return the maneuver at `along_m` [m], at least 0, ahead of the newest detection, for a sensor of `speed_mps`.

    Differs from the dissertation: it gives no amplitude; this one keeps the field of view within the C-target."""
    if not (isfinite(along_m) and along_m >= 0):
        raise ValueError(f"along_m={along_m}: expected 0 or more; behind the newest detection there is no C-target")
    if not (isfinite(speed_mps) and speed_mps > 0):
        raise ValueError(f"speed_mps={speed_mps}: expected more than 0")
    amplitude_m = target.half_width_m(along_m) - target.radius_m
    return Sweep(along_m, amplitude_m if amplitude_m > STANDS * target.radius_m else 0.0, speed_mps)


def sweep_probability(sweep: Sweep, radius_m: float, target_mps: tuple[float, float], begin_s: float = 0.0) -> float:
    """Return P_R of the maneuver, 0 to 1: does the target come within `radius_m` at some time from `begin_s` on?

    `target_mps` are the least and the greatest speed of a target, `begin_s` is the time from the newest detection until
    the sensor has arrived. ValueError for speeds that are not positive or in the wrong order."""
    slowest, fastest = target_mps
    if not (0 < slowest <= fastest < inf):
        raise ValueError(f"target_mps={target_mps}: expected least and greatest speed, 0 < least <= greatest")
    if not (isfinite(begin_s) and begin_s >= 0):
        raise ValueError(f"begin_s={begin_s}: expected 0 or more")
    if not sweep.amplitude_m and not begin_s:
        return 1.0 if sweep.along_m <= radius_m else 2.0 * asin(radius_m / sweep.along_m) / pi

    point = np.arange(POINTS)
    heading = pi * ((point + 0.5) / POINTS - 0.5)
    speed = slowest + (fastest - slowest) * ((0.5 + point / RECURRENCE) % 1.0)
    along, across = speed * np.cos(heading), speed * np.sin(heading)        # velocity of the target
    if not sweep.amplitude_m:
        return float(np.mean(_meets(along * begin_s - sweep.along_m, across * begin_s, along, across, inf, radius_m)))

    phase = sweep.period_s * ((0.5 + point / RECURRENCE ** 2) % 1.0)
    half = 0.5 * sweep.period_s                     # from one turn of the sensor to the next
    reach = sweep.amplitude_m + radius_m
    last_s = np.minimum((sweep.along_m + radius_m) / along, reach / np.abs(across))     # nothing is met later
    first_s = np.maximum((sweep.along_m - radius_m) / along, begin_s)                   # nor earlier
    met = np.zeros(POINTS, dtype=bool)
    turn = np.floor((first_s + phase) / half)       # number of the sensor's last turn before
    while True:
        from_s = np.maximum(turn * half - phase, first_s)
        open_ = (from_s < last_s) & ~met
        if not open_.any():
            return float(np.mean(met))
        direction = np.where(turn % 2 == 0, 1.0, -1.0)
        sensor = direction * (sweep.speed_mps * (from_s - (turn * half - phase)) - sweep.amplitude_m)
        during = np.maximum((turn + 1) * half - phase - from_s, 0.0)
        met |= open_ & _meets(along * from_s - sweep.along_m, across * from_s - sensor, along,
                              across - direction * sweep.speed_mps, during, radius_m)
        turn = turn + 1


def _meets(x: Floats, y: Floats, vx: Floats, vy: Floats, during_s: Floats | float, radius_m: float) -> Mask:
    """Whether points at (x, y) that move with (vx, vy) come within the radius of the origin during a time."""
    nearest = np.clip(-(x * vx + y * vy) / (vx * vx + vy * vy), 0.0, during_s)
    return np.asarray((x + vx * nearest) ** 2 + (y + vy * nearest) ** 2 <= radius_m ** 2)

