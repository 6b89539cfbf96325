"""The constants of a game. Those marked "printed" are from section 2.4; the dissertation leaves the others open."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from agents.marco_polo.reward import INVESTIGATION, PURSUIT, RewardWeights

SECOND_NS = 1_000_000_000


@dataclass(frozen=True)
class GameParameters:
    """ValueError at construction, with the number that would do, for constants that make no game."""

    detections: int = 3                             # k, printed: 2 or more; a pursuit begins at the k-th
    platform_m: float = 0.5                         # printed, side of a platform of 0.25 m2
    cone_content: float = 0.5                       # of a C-target, between 0 and 1: alpha = 1, half angle 45 degrees
    detection_threshold: float = 0.3                # P_R above which a cell is an observation cell, 0 to 1
    least_area_coverage: float = 0.25               # of the placement; the radii of section 2.4 cover 0.3338 at most
    cell_m: float = 0.5                             # side of a cell: the platform's
    uav_mps: float = 2.0                            # greatest speeds; UGVs are slower than UAVs,
    ugv_mps: float = 1.2                            # and faster than any target, since only they capture
    target_least_mps: float = 0.3                   # a target's speed is uniform between these limits
    target_greatest_mps: float = 0.7
    turn_least_ns: int = 2 * SECOND_NS              # T_min, T_max: time between two turns, uniform between these limits
    turn_greatest_ns: int = 5 * SECOND_NS
    capture_m: float = 0.5                          # distance at which a UGV captures: two platforms that touch
    update_ns: int = SECOND_NS                      # from one computation of the obstacle and coverage maps to the next
    zones_are_obstacles: bool = True                # zones of poor communication are virtual obstacles for planners
    sweeps: bool = False                            # a sensor that investigates moves to and fro across the C-target
    investigation: RewardWeights = INVESTIGATION
    pursuit: RewardWeights = PURSUIT                # the distance weighs more, as printed

    def __post_init__(self) -> None:
        if self.detections < 2:
            raise ValueError(f"detections={self.detections}: k detections end an investigation, which begins at the "
                             "first or later; k is 2 or more, 3 in the dissertation")
        for name in ("platform_m", "cell_m", "uav_mps", "ugv_mps", "target_least_mps", "capture_m", "turn_least_ns",
                     "update_ns"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name}={getattr(self, name)}: expected more than 0")
        if not 0 < self.cone_content < 1:
            raise ValueError(f"cone_content={self.cone_content}: expected 0 < cone_content < 1, as 0.5")
        if not 0 <= self.detection_threshold < 1:
            raise ValueError(f"detection_threshold={self.detection_threshold}: expected 0 <= threshold < 1, as 0.3")
        if not 0 <= self.least_area_coverage <= 1:
            raise ValueError(f"least_area_coverage={self.least_area_coverage}: expected a share of the area, 0 to 1")
        for least, greatest in (("target_least_mps", "target_greatest_mps"), ("turn_least_ns", "turn_greatest_ns")):
            if not getattr(self, least) <= getattr(self, greatest) < float("inf"):
                raise ValueError(f"{greatest}={getattr(self, greatest)}: less than {least}={getattr(self, least)}; "
                                 f"take {getattr(self, least)} or more")
        if not self.ugv_mps > self.target_greatest_mps:
            raise ValueError(f"ugv_mps={self.ugv_mps}: a UGV captures targets of up to target_greatest_mps="
                             f"{self.target_greatest_mps}; make it faster, or the target slower")
        if not self.uav_mps > self.ugv_mps:
            raise ValueError(f"uav_mps={self.uav_mps}: UGVs, {self.ugv_mps} m/s, are slower than UAVs; take more than "
                             f"{self.ugv_mps}")
