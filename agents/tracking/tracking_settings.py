"""The keys of a tracking robot in a scenario. Times are on the local clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from agents.triggering.policies.table import PolicySettings


@dataclass(frozen=True)
class TrackingSettings:
    policy: str = "individual_gains"
    max_successive_losses: int = 0
    certified_radius: float = 10.0                  # [m, m, rad]: the |x| that a periodic policy has to serve
    measurement_noise: float = 0.15
    start: Sequence[float] = (0.0, 0.0, 0.0)        # x [m], y [m], heading [rad] of R1
    refresh_ns: int = 50_000_000                    # the setpoint is repeated: the drive knows that somebody is there
    odometry_age_ns: int = 0                        # from the reading of the wheels to the end of the frame with it
    # What the way to the wheels and back may take. Section 4.6 neglects it; so the trigger does, but an assumption that
    # fails by no more than this is not reported.
    actuation_ns: int = 5_000_000

    def policy_settings(self) -> PolicySettings:
        return PolicySettings(max_successive_losses=self.max_successive_losses, radius=self.certified_radius)
