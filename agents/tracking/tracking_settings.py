"""The keys of a tracking robot in a scenario. Times are on the local clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from agents.tracking.look_delay import NONE, LookDelay
from agents.triggering.policies.table import PolicySettings


@dataclass(frozen=True)
class TrackingSettings:
    policy: str = "individual_gains"
    max_successive_losses: int = 0
    certified_radius: float = 10.0                  # [m, m, rad] largest |x| for which a periodic policy is certified
    measurement_noise: float = 0.15                 # [m, m, rad] amplitude of nu
    start: Sequence[float] = (0.0, 0.0, 0.0)        # x [m], y [m], heading [rad] of R1
    refresh_ns: int = 50_000_000                    # period of repeated setpoints, without which the drive stops
    odometry_age_ns: int = 0                        # from the reading of the wheels to the end of the frame with it
    # Time from a setpoint to the wheels and back. Section 4.6 and the trigger neglect it; a violation of an assumption
    # by no more than this is not reported.
    actuation_ns: int = 5_000_000

    sure: bool = True                               # False: delays and inputs are not refused, only watched
    sees: str = "reference"                         # event_triggered: the body on the medium `view` that it follows
    speed_max_mps: float = 0.0                      # of a wheel's rim, beyond which it does not command; 0: no limit

    def policy_settings(self, delay: LookDelay = NONE) -> PolicySettings:
        return PolicySettings(max_successive_losses=self.max_successive_losses, radius=self.certified_radius,
                              delay_ns=delay.total_ns, floor_ns=max(delay.airtime_ns, 1))
