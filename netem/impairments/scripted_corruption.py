"""Corruption by script: exactly the named bits of the named frames are flipped. A link numbers its frames from 0.

`corrupt_frames = [3, 7]` with `bits = [[0], [5, 12]]` flips the first bit of frame 3, and two bits of frame 7. Bits
count from the most significant bit of the first byte; one beyond the end of a frame flips nothing. The link's checksum,
if it has one, discards a frame with flipped bits; with `undetected` the checksum finds nothing, as with the fault
`undetected_corruption`. `copy` is as in `scripted_loss`.

Not modelled: chance. For random bit errors use `corrupt`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from msgspec.structs import replace

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.script import Script


@dataclass
class ScriptedCorruption(Impairment):
    loses_as: ClassVar[Fate] = Fate.CORRUPTED

    corrupt_frames: list[int]               # each >= 0
    bits: list[list[int]]                   # for each of them the bits that are flipped, each >= 0
    undetected: bool = False                # whether no checksum finds it
    copy: int | None = None                 # >= 0, None: the original and its duplicates

    def __post_init__(self) -> None:
        self._script = Script("corrupt_frames", self.corrupt_frames, "bits", self.bits, self.copy)
        if not all(self.bits):
            raise ValueError(f"bits={self.bits}: expected at least one bit of each frame")
        if wrong := [bit for bits in self.bits for bit in bits if bit < 0]:
            raise ValueError(f"bits={wrong}: expected 0 or more")

    def written_out(self) -> bool:
        return True

    def carry(self, transit: Transit) -> Iterator[Transit]:
        bits = self._script.at(transit)
        if bits is not None:
            data = bytearray(transit.data)
            for bit in bits:
                if bit < 8 * len(data):
                    data[bit >> 3] ^= 0x80 >> (bit & 7)
            if data != transit.data:
                transit = replace(transit, data=bytes(data), corrupt=True,
                                  undetected=transit.undetected or self.undetected)
        yield transit
