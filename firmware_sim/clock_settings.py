"""The errors of a board's clock, as a scenario gives them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ClockSettings:
    """Offset, drift and tick of a clock; the default is an ideal clock. ValueError for numbers out of range."""

    offset_ns: int = 0          # reading at true time 0, before the tick
    drift_ppm: float = 0.0      # > 0 runs fast
    tick_ns: int = 1            # the reading is a multiple of this

    def __post_init__(self) -> None:
        if self.tick_ns < 1:
            raise ValueError(f"tick_ns={self.tick_ns}: expected at least 1")
        if not -1e6 < self.drift_ppm < 1e6:
            raise ValueError(f"drift_ppm={self.drift_ppm}: expected -1e6 < drift < 1e6, a clock runs forward")
