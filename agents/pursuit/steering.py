"""Steers a differential drive along a commanded velocity u in the plane, forwards or backwards.

    b     = bearing of u from the heading,   b' = b modulo pi in (-pi/2, pi/2]: bearing from the nearer end of the robot
    omega = k b', |omega| <= omega_max       v = |u| cos b, |v| <= v_max - |omega| track / 2

So u . velocity = |u|^2 cos^2 b >= 0: with any heading the robot does not recede from its goal, which the sampling
policy assumes. It may drive backwards, since its sensor is omnidirectional.
Differs from the dissertation, where (3.6) is for pursuers that move freely; it does not say how its P3-ATs follow u.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, isfinite, pi, remainder

from agents.pursuit import Place
from agents.tracking.controller import Command

STILL_MPS = 0.02                # for a slower u the robot does not turn


@dataclass(frozen=True)
class Steering:
    v_max_mps: float            # largest speed of a wheel's rim
    track_m: float
    omega_max_radps: float = 1.0
    turn_gain_per_s: float = 2.0

    def __post_init__(self) -> None:
        for name in ("v_max_mps", "track_m", "omega_max_radps", "turn_gain_per_s"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name}={getattr(self, name)}: expected more than 0")

    def command(self, velocity_mps: Place, heading_rad: float) -> Command:
        speed = hypot(*velocity_mps)
        if speed < STILL_MPS:
            return Command(0.0, 0.0)
        bearing = remainder(atan2(velocity_mps[1], velocity_mps[0]) - heading_rad, 2 * pi)
        omega = self.turn_gain_per_s * remainder(bearing, pi)
        omega = max(-self.omega_max_radps, min(self.omega_max_radps, omega))
        most = max(0.0, self.v_max_mps - abs(omega) * self.track_m / 2)
        return Command(max(-most, min(most, speed * cos(bearing))), omega)
