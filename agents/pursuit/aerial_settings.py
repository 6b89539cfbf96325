"""The settings of a flying pursuer's companion in a scenario, and the pursuer built from them."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

from agents.pursuit.law import PursuitLaw
from agents.pursuit.no_escape import problems
from agents.pursuit.pursuer import Pursuer
from agents.pursuit.sampling.adaptive import Adaptive
from agents.pursuit.target_estimators import Known, target_estimator
from agents.pursuit.zones import Zones


@dataclass(frozen=True)
class AerialSettings:
    """Times are on the local clock."""

    height_m: float                     # height of the flight; the take-off climbs to the parameter MIS_TAKEOFF_ALT
    radius_m: float                     # R, range of the medium `view`
    no_moving_m: float                  # eta
    escape_m: float                     # zeta
    v_max_mps: float                    # largest speed of the target
    sigma_m: float                      # standard deviation of a detection's x and y
    rho_m: float                        # prediction error from which on the filter is fitted anew
    estimator: str = "circle"           # one of `ESTIMATORS`
    window: int = 7                     # Gamma, number of detections in the circle filter
    process_m2: float = 0.01            # Q of "ukf" and "particle" [m2, m2, rad2]
    particles: int = 1000
    gain_per_s: float = 2.0             # K, speed per distance of the autopilot's ramp near a waypoint
    speed_mps: float = 1.5              # its speed farther away, VEL_MAX
    heading_rad: float = 0.0            # constant heading, from x to y
    step_ns: int = 70_000_000           # T_s
    offset_ns: int = 0                  # instants are at offset + k T_s
    execution_ns: int = 5_000_000       # from an instant until its frames are sent
    latency_ns: int = 70_000_000        # from an exposure until the instant that reads its detections
    response_ns: int = 0                # from a waypoint until the vehicle flies towards it
    resend_every: int = 2               # instants between repetitions of a waypoint
    position_every_ns: int = 100_000_000        # period of the vehicle's position messages
    attitude_every_ns: int = 500_000_000        # period of its attitude messages
    retry_ns: int = 500_000_000         # from a command without an answer until it is repeated

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
        self.pursuer(Random(0))
        if wrong := problems(self.zones, self.law, self.v_max_mps, self.sigma_m, self.step_ns,
                             self.latency_ns + self.response_ns):
            raise ValueError("\n".join(wrong))

    @property
    def zones(self) -> Zones:
        return Zones(self.radius_m, self.no_moving_m, self.escape_m)

    @property
    def law(self) -> PursuitLaw:
        return PursuitLaw(self.gain_per_s, self.speed_mps)

    def pursuer(self, rng: Random) -> Pursuer:
        """Return a new pursuer, which has no detection yet; a filter with particles draws its seed from `rng`."""
        known = Known(self.window, self.rho_m, self.v_max_mps, self.sigma_m, self.step_ns, self.process_m2,
                      self.particles)
        estimator = target_estimator(self.estimator, known, rng)
        sampling = Adaptive(self.step_ns, self.zones, self.v_max_mps, self.latency_ns)
        return Pursuer(estimator, sampling, self.law, self.zones, self.rho_m)
