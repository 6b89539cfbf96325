"""A frame's bits one by one, as its sender sends them, with their fields, for transmissions with errors.

'0' is dominant, '1' recessive. The ACK slot is dominant, as receivers make it. The bus encodes a frame without errors
faster, in `encoded_frame.py`, which has the fields and their source.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import lru_cache

from netem.media.can.crc import CRC_15, CRC_17, CRC_21
from netem.media.can.encoded_frame import LARGEST_DLC_WITH_CRC_17, with_data
from netem.media.can.frame import unpack
from netem.media.can.stuffing import stuffed

GRAY = (0b000, 0b001, 0b011, 0b010, 0b110, 0b111, 0b101, 0b100)


class Field(Enum):
    ARBITRATION = "arbitration field"       # SOF up to RTR, or RRS of CAN FD
    CONTROL = "control field"
    DATA = "data field"
    CRC = "CRC sequence"                    # with the stuff count of CAN FD
    CRC_DELIMITER = "CRC delimiter"
    ACK_SLOT = "ACK slot"
    ACK_DELIMITER = "ACK delimiter"
    EOF = "end of frame"


@dataclass(frozen=True)
class BitSequence:
    """The bits of one frame. `fields[k]` is the field of `bits[k]`; a stuff bit has the field of the bit before it."""

    bits: str
    fields: tuple[Field, ...]
    stuff: frozenset[int]           # indices of stuff bits, including fixed ones
    fast_from: int                  # bits [fast_from, fast_until) are at the data bit rate
    fast_until: int

    def __len__(self) -> int:
        return len(self.bits)

    def first(self, field: Field) -> int:
        """Index of the first bit of `field`."""
        return self.fields.index(field)

    def rates_up_to(self, bit: int) -> tuple[int, int]:
        """(nominal, data) bits from SOF up to and including `bit`."""
        fast = max(0, min(bit + 1, self.fast_until) - self.fast_from)
        return bit + 1 - fast, fast


@lru_cache(maxsize=256)
def bit_sequence(data: bytes) -> BitSequence:
    """Return the bits of a well-formed struct, as a node sends it."""
    frame = unpack(data)
    value, length = with_data(frame)
    arbitration = 33 if frame.extended else 13
    control = length - 8 * len(frame.data) - arbitration
    fields = [Field.ARBITRATION] * arbitration + [Field.CONTROL] * control + [Field.DATA] * (8 * len(frame.data))
    if not frame.fd:
        crc = CRC_15.of(value, length)
        bits, places = _dynamic(f"{value << 15 | crc:0{length + 15}b}", at_end=True)
        fields = _with_stuff([*fields, *[Field.CRC] * 15], places)
        fixed: list[int] = []
        fast_from = fast_until = 0
    else:
        plain = f"{value:0{length}b}"
        bits, places = _dynamic(plain, at_end=False)
        fields = _with_stuff(fields, places)
        switch = length - 8 * len(frame.data) - 6                   # the bit BRS
        fast_from = switch + sum(place <= switch for place in _before(places)) + 1
        crc_field, fixed = _crc_field(value, length, len(places), frame.dlc, bits[-1])
        fixed = [len(bits) + place for place in fixed]
        bits += crc_field
        fields += [Field.CRC] * len(crc_field)
        fast_until = len(bits) + 1
        if not frame.bit_rate_switch:
            fast_from = fast_until = 0
    end = [Field.CRC_DELIMITER, Field.ACK_SLOT, Field.ACK_DELIMITER, *[Field.EOF] * 7]
    return BitSequence(bits + "1" + "0" + "1" * 8, (*fields, *end), frozenset([*places, *fixed]),
                       fast_from, fast_until)


def _dynamic(plain: str, *, at_end: bool) -> tuple[str, list[int]]:
    """Insert stuff bits; returns the bits and the indices of the stuff bits."""
    sent, places, run = "", [], 0
    for index, bit in enumerate(plain):
        run = run + 1 if sent and bit == sent[-1] else 1
        sent += bit
        if run == 5 and (at_end or index < len(plain) - 1):
            places.append(len(sent))
            sent += "1" if bit == "0" else "0"
            run = 1
    return sent, places


def _with_stuff(fields: list[Field], places: list[int]) -> list[Field]:
    out = list(fields)
    for place in places:
        out.insert(place, out[place - 1])
    return out


def _before(places: list[int]) -> list[int]:
    """For each stuff bit, the number of bits before it that are no stuff bits."""
    return [place - earlier for earlier, place in enumerate(places)]


def _crc_field(value: int, length: int, stuff_count: int, dlc: int, last: str) -> tuple[str, list[int]]:
    """Return stuff count and CRC with their fixed stuff bits, and the indices of the stuff bits."""
    gray = GRAY[stuff_count % 8]
    count = gray << 1 | gray.bit_count() & 1
    covered = f"{stuffed(value, length)}{count:04b}"
    crc = CRC_17 if dlc <= LARGEST_DLC_WITH_CRC_17 else CRC_21
    plain = f"{count:04b}{crc.of(int(covered, 2), len(covered)):0{crc.width}b}"
    sent, places = "", []
    for index, bit in enumerate(plain):
        if index % 4 == 0:
            places.append(len(sent))
            sent += "1" if (sent or last)[-1] == "0" else "0"
        sent += bit
    return sent, places
