"""Parameters of a sensor that uses the Adaptive Filter when it pursues (section 3.4)."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from agents.estimation.circle_filter import CircleFilter
from agents.marco_polo_game.game_table import Game
from agents.marco_polo_game.sensor_settings import SensorSettings
from agents.pursuit.law import PursuitLaw
from agents.pursuit.no_escape import SPARE_STEPS, least_escape_m
from agents.pursuit.pursuer import Pursuer, adaptive_pursuer
from agents.pursuit.zones import Zones


@dataclass(frozen=True, kw_only=True)
class AdaptiveSettings(SensorSettings):
    exposure_latency_ns: int            # of the sensing medium, from an exposure until its detections arrive
    filter_window: int = 3              # Gamma, detections in the filter
    rho_m: float = 0.2                  # prediction error from which on the filter is fitted anew
    sigma_m: float = 0.0                # standard deviation of a detection's x and y
    sure: bool = True                   # refuse fields of view from which a target may escape

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.exposure_latency_ns < self.exposure_ns // 2:
            raise ValueError(f"exposure_latency_ns={self.exposure_latency_ns}: expected 0 or more, and less than half "
                             f"of exposure_ns={self.exposure_ns}, when the next look is decided on")
        for name in ("rho_m", "sigma_m"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ValueError(f"{name}={getattr(self, name)}: expected 0 or more")
        CircleFilter(self.filter_window)

    def pursuer(self, game: Game, name: str) -> Pursuer:
        """Return a new pursuer for the sensor `name`, which has no detection yet.

        ValueError, with the number that would do, if a target may escape from its field of view and `sure` is set, or
        if the field of view is smaller than its escape area. The escape area has
        room for the way that the sensor drives in one step, since to the intercept it may recede from the detection.
        """
        radius_m, speed_mps = game.radius_m[name], game.speed_mps(name)
        v_max_mps, step_ns = game.parameters.target_greatest_mps, self.exposure_ns
        escape_m = speed_mps * step_ns * 1e-9 + least_escape_m(v_max_mps, self.sigma_m, step_ns,
                                                               self.exposure_latency_ns)
        least_m = escape_m + 2 * SPARE_STEPS * step_ns * 1e-9 * v_max_mps
        if radius_m < least_m and (self.sure or radius_m <= escape_m):
            raise ValueError(f"team.radius_m.{name}={radius_m}: a target of {v_max_mps} m/s can leave the field of "
                             f"view between two looks; take {least_m:.4g} m or more, or shorten exposure_ns={step_ns}")
        no_moving_m = 0.5 * (radius_m - escape_m)
        return adaptive_pursuer(
            CircleFilter(self.filter_window, rho_m=self.rho_m, v_max_mps=v_max_mps, sigma_m=self.sigma_m),
            Zones(radius_m, no_moving_m, escape_m), PursuitLaw(v_max_mps / no_moving_m, speed_mps),
            v_max_mps=v_max_mps, sigma_m=self.sigma_m, step_ns=step_ns, rho_m=self.rho_m,
            latency_ns=self.exposure_latency_ns, sure=self.sure)
