"""The keys of a flying pursuer's companion in a scenario, and the pursuer that they make."""

from __future__ import annotations

from dataclasses import dataclass

from agents.estimation.circle_filter import CircleFilter
from agents.pursuit.law import PursuitLaw
from agents.pursuit.no_escape import problems
from agents.pursuit.pursuer import Pursuer
from agents.pursuit.sampling.adaptive import Adaptive
from agents.pursuit.zones import Zones


@dataclass(frozen=True)
class AerialSettings:
    """Times are on the local clock."""

    height_m: float                     # that it flies at; its take-off goes to MIS_TAKEOFF_ALT
    radius_m: float                     # R, of the medium `view`
    no_moving_m: float                  # eta
    escape_m: float                     # zeta
    v_max_mps: float                    # of the target
    sigma_m: float                      # of a detection
    rho_m: float
    window: int = 7                     # Gamma, detections of the filter
    gain_per_s: float = 2.0             # K: of the autopilot's ramp near a waypoint
    speed_mps: float = 1.5              # and farther off: its VEL_MAX
    heading_rad: float = 0.0            # that is held, from x to y
    step_ns: int = 70_000_000           # T_s
    offset_ns: int = 0
    execution_ns: int = 5_000_000       # from an instant to what it hands out
    latency_ns: int = 70_000_000        # from an exposure until the instant that reads its news
    response_ns: int = 0                # from a waypoint until the vehicle flies there
    resend_every: int = 2               # instants
    position_every_ns: int = 100_000_000        # of the vehicle's telemetry
    attitude_every_ns: int = 500_000_000
    retry_ns: int = 500_000_000         # of an order without an answer

    def __post_init__(self) -> None:
        if self.step_ns < 1:
            raise ValueError(f"step_ns={self.step_ns}: expected 1 or more")
        if not 0 <= self.offset_ns < self.step_ns:
            raise ValueError(f"offset_ns={self.offset_ns}: expected 0 <= offset < step ({self.step_ns} ns)")
        if not 0 <= self.execution_ns < self.step_ns:
            raise ValueError(f"execution_ns={self.execution_ns}: expected 0 <= execution < step ({self.step_ns} ns)")
        if not self.height_m > 0:
            raise ValueError(f"height_m={self.height_m}: expected more than 0")
        for name in ("response_ns", "position_every_ns", "attitude_every_ns"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name}={getattr(self, name)}: expected 0 or more")
        if self.resend_every < 1:
            raise ValueError(f"resend_every={self.resend_every}: expected 1 or more")
        self.pursuer()
        if wrong := problems(self.zones, self.law, self.v_max_mps, self.sigma_m, self.step_ns,
                             self.latency_ns + self.response_ns):
            raise ValueError("\n".join(wrong))

    @property
    def zones(self) -> Zones:
        return Zones(self.radius_m, self.no_moving_m, self.escape_m)

    @property
    def law(self) -> PursuitLaw:
        return PursuitLaw(self.gain_per_s, self.speed_mps)

    def pursuer(self) -> Pursuer:
        """A new one, that has seen nothing yet."""
        estimator = CircleFilter(self.window, rho_m=self.rho_m, v_max_mps=self.v_max_mps, sigma_m=self.sigma_m)
        sampling = Adaptive(self.step_ns, self.zones, self.v_max_mps, self.latency_ns)
        return Pursuer(estimator, sampling, self.law, self.zones, self.rho_m)
