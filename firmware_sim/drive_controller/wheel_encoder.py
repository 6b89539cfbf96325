"""An incremental encoder on a wheel: counts from the angle, and the speed from two readings.

    count = floor(angle / 2 pi counts_per_turn), as a 32-bit counter that wraps
    speed = 2 pi / counts_per_turn (count - last count) / elapsed

The counter gives the mean speed since the last reading, in steps of 2 pi / (counts_per_turn elapsed).
Not modelled: missed counts, jitter of the reading, eccentric discs.
"""

from __future__ import annotations

from math import floor, pi
from typing import Final

WRAP: Final = 1 << 32


class WheelEncoder:
    def __init__(self, counts_per_turn: int) -> None:
        self.counts_per_turn = counts_per_turn
        self.count = 0                      # last reading, -2^31 <= count < 2^31
        self.speed_radps = 0.0

    def restart(self, angle_rad: float) -> None:
        """Take a reading without a speed: the first one, or one at an unknown time after the last."""
        self.count = self._counter(angle_rad)

    def read(self, angle_rad: float, elapsed_ns: int) -> None:
        """Take a reading; `elapsed_ns` > 0 is the local time since the last one."""
        before, self.count = self.count, self._counter(angle_rad)
        self.speed_radps = 2 * pi / self.counts_per_turn * _signed(self.count - before) / (elapsed_ns / 1e9)

    def _counter(self, angle_rad: float) -> int:
        return _signed(floor(angle_rad / (2 * pi) * self.counts_per_turn))


def _signed(count: int) -> int:
    """Return `count` as a signed 32-bit integer."""
    return (count + WRAP // 2) % WRAP - WRAP // 2
