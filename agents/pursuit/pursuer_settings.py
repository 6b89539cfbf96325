"""The settings of a pursuer in a scenario, and the pursuer built from them."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

from agents.pursuit.law import PursuitLaw
from agents.pursuit.pursuer import Pursuer, adaptive_pursuer
from agents.pursuit.steering import Steering
from agents.pursuit.target_estimators import Known, target_estimator
from agents.pursuit.zones import Zones


@dataclass(frozen=True)
class ChaseSettings:
    """The parameters that robots on wheels, in the air and of (3.1) have in common. Times are on the local clock."""

    radius_m: float = 2.3                       # R, range of the medium `view`
    no_moving_m: float = 1.15                   # eta
    escape_m: float = 0.55                      # zeta
    gain_per_s: float = 1.0                     # K
    speed_mps: float = 0.7                      # u_max
    v_max_mps: float = 0.35                     # largest speed of the target
    sigma_m: float = 0.1                        # standard deviation of a detection's x and y
    estimator: str = "circle"                   # one of `ESTIMATORS`
    window: int = 5                             # Gamma, number of detections in the circle filter
    rho_m: float = 0.2                          # prediction error from which on the filter is fitted anew
    process_m2: float = 0.01                    # Q of "ukf" and "particle" [m2, m2, rad2]
    particles: int = 1000
    step_ns: int = 70_000_000                   # T_s
    latency_ns: int = 0                         # longest time from an exposure to its answer that the policy allows for
    execution_ns: int = 2_000_000               # from an instant or a detection to the decision
    sure: bool = True                           # refuse settings that break a condition of no escape
    target: str = ""                            # name of the agent that it follows; "": none
    view: str = "view"                          # name of the port on the sensing medium

    @property
    def ports(self) -> dict[str, str]:
        """The names of the ports, by the setting that gives each."""
        return {"view": self.view}

    def __post_init__(self) -> None:
        if self.step_ns < 1:
            raise ValueError(f"step_ns={self.step_ns}: expected 1 or more")
        if not 0 <= self.execution_ns < self.step_ns:
            raise ValueError(f"execution_ns={self.execution_ns}: expected 0 <= execution < step ({self.step_ns} ns), "
                             f"or no decision comes in time for the next instant")
        self.pursuer(Random(0))

    def pursuer(self, rng: Random) -> Pursuer:
        """Return a new pursuer, which has no detection yet; a filter with particles draws its seed from `rng`."""
        known = Known(self.window, self.rho_m, self.v_max_mps, self.sigma_m, self.step_ns, self.process_m2,
                      self.particles)
        return adaptive_pursuer(target_estimator(self.estimator, known, rng), self.zones,
                                PursuitLaw(self.gain_per_s, self.speed_mps), v_max_mps=self.v_max_mps,
                                sigma_m=self.sigma_m, step_ns=self.step_ns, rho_m=self.rho_m,
                                latency_ns=self.latency_ns, sure=self.sure)

    @property
    def zones(self) -> Zones:
        return Zones(self.radius_m, self.no_moving_m, self.escape_m)


@dataclass(frozen=True)
class PursuerSettings(ChaseSettings):
    """Settings of a pursuer on a differential drive; `speed_mps` is also the largest speed of a wheel's rim."""

    odometry_age_ns: int = 0                    # from the reading of the wheels until the frame is received
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)     # x [m], y [m], heading [rad]
    can: str = "can"                            # name of the port to the drive

    @property
    def ports(self) -> dict[str, str]:
        return {**super().ports, "can": self.can}

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.odometry_age_ns < 0:
            raise ValueError(f"odometry_age_ns={self.odometry_age_ns}: expected 0 or more")

    def steering(self, track_m: float) -> Steering:
        return Steering(self.speed_mps, track_m)


@dataclass(frozen=True)
class SensorSettings(PursuerSettings):
    """Settings of a pursuer in a team, to which the fusion center assigns targets."""

    radio: str = "radio"                        # name of the port to the team

    @property
    def ports(self) -> dict[str, str]:
        return {**super().ports, "radio": self.radio}
