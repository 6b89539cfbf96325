"""Bits to nanoseconds without drift: an instant is the rounded sum of all bits since a start, never a sum of roundings.

    instant = start + (ticks + ticks_per_ns / 2) // ticks_per_ns        a tick divides a nanosecond and either bit time

At 500 kbit/s a tick is a nanosecond and a bit has 2000; at 300 kbit/s a nanosecond has 3 ticks and a bit 10000.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import gcd, lcm

SECOND_NS = 10**9


@dataclass(frozen=True)
class BitClock:
    """`data_bit_rate_bps` None: there is none, and the nominal one stands for it."""

    bit_rate_bps: int
    data_bit_rate_bps: int | None = None
    ticks_per_ns: int = field(init=False)
    nominal: int = field(init=False)        # ticks of a bit
    data: int = field(init=False)

    def __post_init__(self) -> None:
        data_bps = self.data_bit_rate_bps or self.bit_rate_bps
        ticks = lcm(*(rate // gcd(rate, SECOND_NS) for rate in (self.bit_rate_bps, data_bps)))
        object.__setattr__(self, "ticks_per_ns", ticks)
        object.__setattr__(self, "nominal", ticks * SECOND_NS // self.bit_rate_bps)
        object.__setattr__(self, "data", ticks * SECOND_NS // data_bps)

    def ns(self, ticks: int) -> int:
        """To the nearest nanosecond, halves up."""
        return (ticks + self.ticks_per_ns // 2) // self.ticks_per_ns

    def whole_ns(self, nominal_bits: int, data_bits: int = 0) -> int:
        """So many bits last at least this long, whatever instants they are rounded to."""
        return (nominal_bits * self.nominal + data_bits * self.data) // self.ticks_per_ns

    def most_ns(self, nominal_bits: int, data_bits: int = 0) -> int:
        """So many bits last at most this long."""
        return -(-(nominal_bits * self.nominal + data_bits * self.data) // self.ticks_per_ns)
