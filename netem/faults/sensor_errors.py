"""A sensor's detections are wrong: shifted, stuck at a place, or noisier than usual.

    bias     x, y and z of each detection plus `by_m`
    stuck    each detection has the place of the first one within the window
    noise    x, y and z each plus a normal number of standard deviation `sigma_m`, from the stream of fault and link
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any, ClassVar, Final

from netem.faults import Site
from netem.faults.blackout import SensorFault
from netem.faults.candidates import Between, Candidate, Vector

MOST_DRAWN_M: Final = 1.0


@dataclass(frozen=True)
class Bias(SensorFault):
    how: ClassVar = "shifted"
    by_m: tuple[float, ...]

    @classmethod
    def candidates(cls, site: Site) -> list[Candidate]:
        return [Candidate(on, {"by_m": Vector(3, MOST_DRAWN_M)}) for on in cls.targets(site)]

    def __post_init__(self) -> None:
        if len(self.by_m) not in (2, 3) or not all(map(isfinite, self.by_m)) or not any(self.by_m):
            raise ValueError(f"by_m={list(self.by_m)}: expected [x, y] or [x, y, z], finite and not all 0")

    def fields(self) -> Mapping[str, Any]:
        return {"by_m": (*self.by_m, 0.0)[:3]}


@dataclass(frozen=True)
class Stuck(SensorFault):
    how: ClassVar = "frozen"


@dataclass(frozen=True)
class Noise(SensorFault):
    how: ClassVar = "noisier"
    sigma_m: float

    @classmethod
    def candidates(cls, site: Site) -> list[Candidate]:
        return [Candidate(on, {"sigma_m": Between(0.0, MOST_DRAWN_M)}) for on in cls.targets(site)]

    def __post_init__(self) -> None:
        if not (isfinite(self.sigma_m) and self.sigma_m > 0):
            raise ValueError(f"sigma_m={self.sigma_m}: expected more than 0")

    def fields(self) -> Mapping[str, Any]:
        return {"sigma_m": self.sigma_m}
