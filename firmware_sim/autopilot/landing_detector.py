"""Detects that the vehicle stands: it is commanded to sink, but the accelerometer measures the ground's support.

    commanded lift < 0.8 of hovering      |specific force - g| < 0.5 m/s2      body rates < 0.2 rad/s      for 0.3 s

In the air, with so little lift, the accelerometer would measure at most 0.8 g. So neither height nor velocity is
needed, and the detector works without motion capture.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot

from firmware_sim.autopilot.airframe import GRAVITY
from firmware_sim.autopilot.vehicle import Vector

SINKING = 0.8           # share of the hovering lift
CARRIED = 0.5           # [m/s2] largest difference of the specific force from g
AT_REST = 0.2           # [rad/s] largest body rate
FOR_NS = 300_000_000


@dataclass
class LandingDetector:
    _since_ns: int | None = field(default=None, init=False)

    def restart(self) -> None:
        self._since_ns = None

    def stands(self, now_ns: int, thrust_n: float, hover_n: float, force_mps2: Vector, rates_radps: Vector) -> bool:
        carried = abs(hypot(*force_mps2) - GRAVITY) < CARRIED
        if carried and thrust_n < SINKING * hover_n and hypot(*rates_radps) < AT_REST:
            if self._since_ns is None or self._since_ns > now_ns:
                self._since_ns = now_ns
            return now_ns - self._since_ns >= FOR_NS
        self._since_ns = None
        return False
