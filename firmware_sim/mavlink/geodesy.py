"""The flat map around the origin: converts metres north and east to degrees and back.

    latitude = latitude0 + north / R        longitude = longitude0 + east / (R cos latitude0)        R = 6 371 000 m

The map serves clients that fly by latitude and longitude; the vehicle itself knows only metres. Both directions are the
same linear map, so conversions there and back do not drift. Compared with a sphere the error is about
d^2 tan(latitude) / R at a distance d: 2 mm at 100 m and 45 degrees. `latitude_e7` and `longitude_e7` are whole 1e-7
degrees (1.1 cm of latitude), as in MAVLink.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, degrees, isfinite, radians
from typing import Final

EARTH_RADIUS_M: Final = 6_371_000.0
E7: Final = 1e7


@dataclass(frozen=True)
class Origin:
    latitude_deg: float = 47.397742
    longitude_deg: float = 8.545594
    altitude_m: float = 488.0

    def __post_init__(self) -> None:
        if not (isfinite(self.latitude_deg) and abs(self.latitude_deg) <= 85):
            raise ValueError(f"latitude_deg={self.latitude_deg}: expected -85 to 85, near the poles no map is flat")
        if not (isfinite(self.longitude_deg) and abs(self.longitude_deg) <= 180):
            raise ValueError(f"longitude_deg={self.longitude_deg}: expected -180 to 180")
        if not (isfinite(self.altitude_m) and -500 <= self.altitude_m <= 10_000):
            raise ValueError(f"altitude_m={self.altitude_m}: expected -500 to 10000")

    def to_global(self, north_m: float, east_m: float) -> tuple[int, int]:
        """Return (latitude_e7, longitude_e7)."""
        latitude = self.latitude_deg + degrees(north_m / EARTH_RADIUS_M)
        longitude = self.longitude_deg + degrees(east_m / self._radius_m())
        return round(latitude * E7), round(longitude * E7)

    def to_local(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """Return (north_m, east_m)."""
        return (radians(latitude_deg - self.latitude_deg) * EARTH_RADIUS_M,
                radians(longitude_deg - self.longitude_deg) * self._radius_m())

    def _radius_m(self) -> float:
        return EARTH_RADIUS_M * cos(radians(self.latitude_deg))
