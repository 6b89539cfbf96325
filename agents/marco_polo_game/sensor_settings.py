"""Parameters of a sensor in the Marco Polo game, beside those of the bidding protocol."""

from __future__ import annotations

from dataclasses import dataclass

from agents.bidding.bid_timing import BiddingSettings
from agents.marco_polo_game.movers.table import PlatformSettings


@dataclass(frozen=True, kw_only=True)
class SensorSettings(PlatformSettings, BiddingSettings):
    view: str                           # name of the sensing medium with this sensor's field of view
    exposure_ns: int                    # its exposure period
    grip: str = "grip"                  # name of the medium on which UGVs capture targets

    def __post_init__(self) -> None:
        super().__post_init__()
        _ = self.platform
        if self.exposure_ns < 1:
            raise ValueError(f"exposure_ns={self.exposure_ns}: expected at least 1")
