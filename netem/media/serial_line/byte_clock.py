"""Durations of bytes on a serial line: asynchronous characters, sent back to back.

    start bit, data bits (least significant first), parity bit or none, stop bits         8N1: 10 bits a byte
    end of the k-th byte of a stretch without a gap = begin + ceil(k bits_per_byte / baud)

Each end is computed from k, so rounding errors do not add up. Source: the character frame of EIA/TIA-232.
Not modelled: a difference between the two ends' baud rates, break conditions.
"""

from __future__ import annotations

from dataclasses import dataclass

SECOND_NS = 1_000_000_000


@dataclass(frozen=True)
class ByteClock:
    baud_bps: int
    bits_per_byte: int

    def end_ns(self, count: int) -> int:
        """Duration of `count` bytes without a gap."""
        return -(-count * self.bits_per_byte * SECOND_NS // self.baud_bps)

    def begun(self, elapsed_ns: int) -> int:
        """Number of bytes without a gap that have begun within [0, elapsed_ns], `elapsed_ns` >= 0."""
        return elapsed_ns * self.baud_bps // (self.bits_per_byte * SECOND_NS) + 1
