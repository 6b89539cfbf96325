"""Corruption: bits of the frame are flipped, and the copy is marked so that a link with a checksum discards it.

A scenario sets exactly one of two ratios:
    bit_error_ratio p   every bit flips independently; flips per frame ~ binomial(8 bytes, p); a frame of n bits has no
                        error with probability (1 - p)^n
    frame_ratio         this share of the frames has one random bit flipped (`tc netem corrupt`)

The number of good bits between two bit errors is geometric, floor(log(u) / log(1 - p)). The count goes on from frame to
frame, so a frame without error needs no draw. Bits count from the first byte's most significant bit.

Not modelled: errors in bits that only the link sees (preamble, header, checksum); bursts of bit errors.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import log, log1p
from random import Random
from typing import ClassVar

from msgspec.structs import replace

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.checks import expect_ratio, expect_ratio_below_one


@dataclass
class Corrupt(Impairment):
    loses_as: ClassVar[Fate] = Fate.CORRUPTED

    bit_error_ratio: float | None = None    # 0 <= bit_error_ratio < 1
    frame_ratio: float | None = None        # 0 <= frame_ratio <= 1
    rng: Random = field(kw_only=True)

    def __post_init__(self) -> None:
        if (self.bit_error_ratio is None) == (self.frame_ratio is None):
            raise ValueError(f"bit_error_ratio={self.bit_error_ratio}, frame_ratio={self.frame_ratio}: "
                             "give exactly one of them")
        if self.frame_ratio is not None:
            expect_ratio("frame_ratio", self.frame_ratio)
        if self.bit_error_ratio is not None:
            expect_ratio_below_one("bit_error_ratio", self.bit_error_ratio)
        self._good_bits: float | None = None        # before the next bit error; None until the first copy

    def carry(self, transit: Transit) -> Iterator[Transit]:
        flips = self._chosen_frame(8 * len(transit.data)) if self.bit_error_ratio is None else \
            self._bit_errors(8 * len(transit.data), self.bit_error_ratio)
        if flips:
            data = bytearray(transit.data)
            for bit in flips:
                data[bit >> 3] ^= 0x80 >> (bit & 7)
            transit = replace(transit, data=bytes(data), corrupt=True)
        yield transit

    def _chosen_frame(self, bits: int) -> list[int]:
        assert self.frame_ratio is not None
        if bits and self.rng.random() < self.frame_ratio:
            return [int(self.rng.random() * bits)]
        return []

    def _bit_errors(self, bits: int, ratio: float) -> list[int]:
        if ratio == 0:
            return []
        if self._good_bits is None:
            self._good_bits = self._distance(ratio)
        flips = []
        while self._good_bits < bits:
            flips.append(int(self._good_bits))
            self._good_bits += 1 + self._distance(ratio)
        self._good_bits -= bits
        return flips

    def _distance(self, ratio: float) -> int:
        return int(log(1 - self.rng.random()) / log1p(-ratio))
