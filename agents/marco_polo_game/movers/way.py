"""The way that a platform with inertia follows: straight legs near the places that it is given, and its speed on them.

    straightened    those of the places between which straight legs pass, in order, no farther than `aside_m` from the
                    others: each leg is as long as that allows (opening window, Keogh et al. 2001)
    braking         v = k d for d <= a / k^2, else sqrt(2 a (d - a / 2 k^2)): comes to rest after the way d, slowing
                    down by at most a; the law of the autopilot's ramp (`firmware_sim.autopilot.ramp`)
    corner_mps      greatest speed at each corner: of an arc that begins `reach_m` before it, R = reach / tan(turn / 2),
                    v = omega_max R; and no more than lets the platform slow down for the corners behind it
    room_m          how far the boundary of the area is ahead
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, dist, inf, pi, remainder, sin, sqrt, tan

from agents.pursuit import Place
from agents.pursuit.law import Area

CRAWL_MPS = 0.1                 # speed at a corner at which the platform turns round
STRAIGHT = 1e-12                # component of a unit vector below which it does not lead to a side of the area


def straightened(own: Place, places: Sequence[Place], aside_m: float) -> list[Place]:
    """Return the places to drive to, without `own`; the last one is kept.

    A place at which the way turns back is kept as well, so a sensor that is to go to and fro does so."""
    way, start, first = [], own, 0
    for k in range(1, len(places)):
        if not _pass(start, places[first:k], places[k], aside_m):
            start, first = places[k - 1], k
            way.append(start)
    return [*way, *places[-1:]]


def _pass(start: Place, places: Sequence[Place], end: Place, aside_m: float) -> bool:
    """Return whether the leg from `start` to `end` passes all of `places` one after the other."""
    leg_m, before_m = dist(start, end), 0.0
    for x, y in places:
        if leg_m == 0.0:
            return False
        dx, dy = (end[0] - start[0]) / leg_m, (end[1] - start[1]) / leg_m
        along_m = (x - start[0]) * dx + (y - start[1]) * dy
        if not before_m <= along_m <= leg_m or abs((y - start[1]) * dx - (x - start[0]) * dy) > aside_m:
            return False
        before_m = along_m
    return True


def braking(way: float, accel: float, k_per_s: float) -> float:
    """Return the greatest speed [m/s, rad/s] at a distance `way` [m, rad] from rest; `accel` is in m/s2, rad/s2."""
    near = accel / k_per_s ** 2
    return k_per_s * way if way <= near else sqrt(2 * accel * (way - 0.5 * near))


def corner_mps(own: Place, way: Sequence[Place], reach_m: float, omega_max_radps: float, accel_mps2: float,
               k_per_s: float) -> list[float]:
    """Return the greatest speed at each place of a way; 0 at the last."""
    points = [own, *way]
    speeds = [0.0] * len(way)
    for k in reversed(range(len(way) - 1)):
        before, here, after = points[k:k + 3]
        turn = abs(remainder(atan2(after[1] - here[1], after[0] - here[0])
                             - atan2(here[1] - before[1], here[0] - before[0]), 2 * pi))
        half = min(turn, pi - 1e-6) / 2
        arc = inf if half < 1e-6 else omega_max_radps * reach_m / tan(half)
        leg_m = dist(here, after)
        later = (sqrt(speeds[k + 1] ** 2 + 2 * accel_mps2 * leg_m) if speeds[k + 1]
                 else braking(leg_m, accel_mps2, k_per_s))
        speeds[k] = max(CRAWL_MPS, min(arc, later))
    return speeds


def room_m(own: Place, heading_rad: float, area: Area) -> float:
    """Return the distance from a place along a heading to the boundary [m]; 0 outside, if the heading leads away."""
    room = inf
    for at, along, (low, high) in ((own[0], cos(heading_rad), area.x_m), (own[1], sin(heading_rad), area.y_m)):
        if along > STRAIGHT:
            room = min(room, (high - at) / along)
        elif along < -STRAIGHT:
            room = min(room, (low - at) / along)
    return max(0.0, room)
