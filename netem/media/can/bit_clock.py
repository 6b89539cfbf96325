"""Converts bits to nanoseconds without drift: an instant is the rounded sum of all bits since a start.

    instant = start + (ticks + ticks_per_ns / 2) // ticks_per_ns        a tick divides a nanosecond and either bit time

At 500 kbit/s a tick is a nanosecond and a bit has 2000; at 300 kbit/s a nanosecond has 3 ticks and a bit 10000.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import gcd, lcm

SECOND_NS = 10**9


@dataclass(frozen=True)
class BitClock:
    """The bit times of a bus; without `data_bit_rate_bps` data bits last as long as nominal ones."""

    bit_rate_bps: int
    data_bit_rate_bps: int | None = None
    ticks_per_ns: int = field(init=False)
    nominal: int = field(init=False)        # ticks per nominal bit
    data: int = field(init=False)           # ticks per data bit

    def __post_init__(self) -> None:
        data_bps = self.data_bit_rate_bps or self.bit_rate_bps
        ticks = lcm(*(rate // gcd(rate, SECOND_NS) for rate in (self.bit_rate_bps, data_bps)))
        object.__setattr__(self, "ticks_per_ns", ticks)
        object.__setattr__(self, "nominal", ticks * SECOND_NS // self.bit_rate_bps)
        object.__setattr__(self, "data", ticks * SECOND_NS // data_bps)

    def ns(self, ticks: int) -> int:
        """Convert ticks to the nearest nanosecond, rounding halves up."""
        return (ticks + self.ticks_per_ns // 2) // self.ticks_per_ns

    def whole_ns(self, nominal_bits: int, data_bits: int = 0) -> int:
        """Return a lower bound on the time [ns] between the rounded instants of start and end of these bits."""
        return (nominal_bits * self.nominal + data_bits * self.data) // self.ticks_per_ns

    def most_ns(self, nominal_bits: int, data_bits: int = 0) -> int:
        """Return the duration [ns] of these bits, rounded up."""
        return -(-(nominal_bits * self.nominal + data_bits * self.data) // self.ticks_per_ns)
