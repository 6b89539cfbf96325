"""Commands within what a drive can do: both wheels are slowed by one factor, so the robot stays on its arc.

    rim = |v| + |omega| b / 2           speed of the faster wheel's rim, b the track
    u   = (4.4) min(1, speed_max / rim)

Section 4.6 assumes that R1 drives u exactly (4.42), and section 4.7 leaves saturation to future work. With the factor
the reachable set is that of the command driven, but A of (4.47) is that of (4.4): where the factor is below 1, nothing
is certified, and the robot reports it.

Not modelled: limits of the acceleration.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from agents.tracking.controller import Command, Inputs, State, TrackingController


def rim_speed(command: Command | Inputs, track_m: float) -> float:
    """Return the speed [m/s] of the rim of the faster wheel."""
    v_mps, omega_rad_s = command
    return abs(v_mps) + abs(omega_rad_s) * track_m / 2


@dataclass(frozen=True)
class LimitedController(TrackingController):
    """The control law (4.4) with both wheels within `speed_max_mps`."""

    speed_max_mps: float = 1.0
    track_m: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("speed_max_mps", "track_m"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0):
                raise ValueError(f"{name}={value}: expected more than 0")

    def command(self, x: State, inputs: Inputs) -> Command:
        wanted = super().command(x, inputs)
        rim_mps = rim_speed(wanted, self.track_m)
        share = self.speed_max_mps / rim_mps if rim_mps > self.speed_max_mps else 1.0
        return Command(wanted.v_mps * share, wanted.omega_rad_s * share)
