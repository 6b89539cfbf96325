"""Bits that a fault flips behind the checksum, which finds nothing: the copy reaches the program changed."""

from __future__ import annotations

from collections.abc import Iterable
from random import Random
from typing import ClassVar

import msgspec

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment


class UndetectedFlips(Impairment):
    """Flips `flipped_bits` of a copy, each drawn from all of its bits, with the probability `ratio`."""

    loses_as: ClassVar = Fate.LOST          # it loses none

    def __init__(self, ratio: float, flipped_bits: int, rng: Random) -> None:
        self._ratio, self._flipped_bits, self._rng = ratio, flipped_bits, rng

    def carry(self, transit: Transit) -> Iterable[Transit]:
        if not transit.data or self._rng.random() >= self._ratio:
            return (transit,)
        data = bytearray(transit.data)
        for _ in range(self._flipped_bits):
            bit = int(self._rng.random() * 8 * len(data))
            data[bit >> 3] ^= 0x80 >> (bit & 7)
        return (msgspec.structs.replace(transit, data=bytes(data), corrupt=True, undetected=True),)
