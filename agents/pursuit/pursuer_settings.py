"""The settings of a pursuer in a scenario, and the pursuer built from them."""

from __future__ import annotations

from dataclasses import dataclass

from agents.estimation.circle_filter import CircleFilter
from agents.pursuit.law import PursuitLaw
from agents.pursuit.pursuer import Pursuer, adaptive_pursuer
from agents.pursuit.steering import Steering
from agents.pursuit.zones import Zones


@dataclass(frozen=True)
class PursuerSettings:
    """Times are on the local clock."""

    radius_m: float = 2.3                       # R, range of the medium `view`
    no_moving_m: float = 1.15                   # eta
    escape_m: float = 0.55                      # zeta
    gain_per_s: float = 1.0                     # K
    speed_mps: float = 0.7                      # u_max, and the largest speed of a wheel's rim
    v_max_mps: float = 0.35                     # largest speed of the target
    sigma_m: float = 0.1                        # standard deviation of a detection's x and y
    window: int = 5                             # Gamma, number of detections in the filter
    rho_m: float = 0.2                          # prediction error from which on the filter is fitted anew
    step_ns: int = 70_000_000                   # T_s
    latency_ns: int = 0                         # longest time from an exposure to its answer that the policy allows for
    execution_ns: int = 2_000_000               # from an instant or a detection to the decision
    odometry_age_ns: int = 0                    # from the reading of the wheels until the frame is received
    sure: bool = True                           # refuse settings that break a condition of no escape
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)     # x [m], y [m], heading [rad]
    target: str = ""                            # name of the agent that it follows; "": none
    view: str = "view"                          # name of the port on the sensing medium
    can: str = "can"                            # name of the port to the drive

    @property
    def ports(self) -> dict[str, str]:
        """The names of the ports, by the setting that gives each."""
        return {"view": self.view, "can": self.can}

    def __post_init__(self) -> None:
        if self.step_ns < 1:
            raise ValueError(f"step_ns={self.step_ns}: expected 1 or more")
        if not 0 <= self.execution_ns < self.step_ns:
            raise ValueError(f"execution_ns={self.execution_ns}: expected 0 <= execution < step ({self.step_ns} ns), "
                             f"or no decision comes in time for the next instant")
        if self.odometry_age_ns < 0:
            raise ValueError(f"odometry_age_ns={self.odometry_age_ns}: expected 0 or more")
        self.pursuer()

    def pursuer(self) -> Pursuer:
        """Return a new pursuer, which has no detection yet."""
        estimator = CircleFilter(self.window, rho_m=self.rho_m, v_max_mps=self.v_max_mps, sigma_m=self.sigma_m)
        return adaptive_pursuer(estimator, self.zones, PursuitLaw(self.gain_per_s, self.speed_mps),
                                v_max_mps=self.v_max_mps, sigma_m=self.sigma_m, step_ns=self.step_ns, rho_m=self.rho_m,
                                latency_ns=self.latency_ns, sure=self.sure)

    @property
    def zones(self) -> Zones:
        return Zones(self.radius_m, self.no_moving_m, self.escape_m)

    def steering(self, track_m: float) -> Steering:
        return Steering(self.speed_mps, track_m)


@dataclass(frozen=True)
class SensorSettings(PursuerSettings):
    """Settings of a pursuer in a team, to which the fusion center assigns targets."""

    radio: str = "radio"                        # name of the port to the team

    @property
    def ports(self) -> dict[str, str]:
        return {**super().ports, "radio": self.radio}
