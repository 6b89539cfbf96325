"""An incremental encoder on a wheel: angle to counts, and the speed from two readings.

    count = floor(angle / 2 pi counts_per_turn), as a 32-bit counter that wraps
    speed = 2 pi / counts_per_turn (count - last count) / elapsed

The counter gives the mean speed since the last reading, in steps of 2 pi / (counts_per_turn elapsed).
Not modelled: missed counts, jitter of the reading, eccentric discs.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import floor, pi

WRAP = 1 << 32


@dataclass
class WheelEncoder:
    counts_per_turn: int
    count: int = field(default=0, init=False)           # as read last, -2^31 <= count < 2^31
    speed_radps: float = field(default=0.0, init=False)

    def restart(self, angle_rad: float) -> None:
        """A reading that says nothing about the speed: the first one, or one of which it is not known how old it is."""
        self.count = self._counter(angle_rad)

    def read(self, angle_rad: float, elapsed_ns: int) -> None:
        """`elapsed_ns` > 0: since the last reading, local."""
        before, self.count = self.count, self._counter(angle_rad)
        self.speed_radps = 2 * pi / self.counts_per_turn * _signed(self.count - before) / (elapsed_ns / 1e9)

    def _counter(self, angle_rad: float) -> int:
        return _signed(floor(angle_rad / (2 * pi) * self.counts_per_turn))


def _signed(count: int) -> int:
    """As 32 bits hold it in two's complement."""
    return (count + WRAP // 2) % WRAP - WRAP // 2
