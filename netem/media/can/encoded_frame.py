"""Encodes a frame for a transmission without errors: its number of bits at either bit rate, and its arbitration rank.

    classical   SOF id RTR IDE r0 DLC data CRC-15 | CRC delimiter, ACK slot, ACK delimiter, EOF 7
                \\___________ stuffed ____________/
    CAN FD      SOF id RRS IDE FDF res BRS | ESI DLC data | stuff count 4, CRC-17/21 | CRC delimiter | ACK 1 + 1, EOF 7
                \\______________ stuffed _____________/ \\__ a fixed stuff bit first, then after every 4 bits __/
                nominal bit rate ----------> data bit rate (with BRS) ------------------------------> nominal

The rate changes at the sample points of BRS and of the CRC delimiter. The parts of both bits at either rate add up to a
nominal BRS and a delimiter at the data rate, as which they are counted. A fixed stuff bit follows the last data bit of
CAN FD instead of a dynamic one. The stuff count is the number of stuff bits modulo 8 as a Gray code, with a bit of even
parity.

The rank is the arbitration field as a number with dominant = 0, so the lower one wins: a standard identifier before an
extended one with the same base, a data frame before a remote one.

Source: ISO 11898-1:2015, 10.4.2 and 10.5.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

from netem.media.can.crc import CRC_15
from netem.media.can.frame import CanFrame, MalformedFrame, pack, unpack
from netem.media.can.stuffing import stuff_bits

AFTER_CRC_BITS: Final = 10              # CRC delimiter, ACK slot, ACK delimiter, EOF
AFTER_FD_CRC_BITS: Final = 9            # the same without the CRC delimiter
FD_CRC_FIELD_BITS: Final = (4 + 17 + 6, 4 + 21 + 7)    # stuff count, CRC, fixed stuff bits; up to and beyond 16 bytes
LARGEST_DLC_WITH_CRC_17: Final = 10
CACHED_FRAMES: Final = 1 << 15


class EncodedFrame(NamedTuple):
    rank: int                   # the lowest wins arbitration; equal only for the same arbitration field
    nominal_bits: int           # from SOF to the end of EOF, at the nominal bit rate
    data_bits: int              # at the data bit rate
    fd: bool
    data: bytes                 # the frame as receivers get it


def rank_of(frame: CanFrame) -> int:
    """The arbitration field as 32 bits: 11 of the identifier, RTR or SRR, IDE, 18 of the identifier, RTR."""
    if frame.extended:
        base, rest = frame.can_id >> 18, frame.can_id & 0x3FFFF
        return base << 21 | 3 << 19 | rest << 1 | frame.remote
    return frame.can_id << 21 | frame.remote << 20


def header_of(frame: CanFrame) -> tuple[int, int]:
    """(bits, number of bits) from SOF up to and including DLC."""
    can_id = frame.can_id
    if frame.extended:
        can_id = can_id >> 18 << 20 | 3 << 18 | can_id & 0x3FFFF        # SRR, IDE after the base
    if not frame.fd:                                                    # RTR, IDE or r1, r0, DLC
        return can_id << 7 | frame.remote << 6 | frame.dlc, 39 if frame.extended else 19
    control = 1 << 7 | frame.bit_rate_switch << 5 | frame.error_state << 4 | frame.dlc      # FDF res BRS ESI DLC
    return (can_id << 9 | control, 41) if frame.extended else (can_id << 10 | control, 22)  # RRS; RRS, IDE


def with_data(frame: CanFrame) -> tuple[int, int]:
    """(bits, number of bits) from SOF up to and including the data, before stuffing."""
    bits, length = header_of(frame)
    size = 8 * len(frame.data)
    return bits << size | int.from_bytes(frame.data, "big"), length + size


@lru_cache(maxsize=CACHED_FRAMES)
def encode_frame(data: bytes) -> EncodedFrame:
    """Encode the struct that a node sends; raises `MalformedFrame`."""
    frame = unpack(data)
    if frame.error:
        raise MalformedFrame("an error message, which no node can send")
    bits, length = with_data(frame)
    if frame.fd:
        nominal, fast = _fd_bits(frame, bits, length)
    else:
        crc = CRC_15.of(bits, length)
        nominal, fast = length + 15 + stuff_bits(bits << 15 | crc, length + 15, at_end=True) + AFTER_CRC_BITS, 0
    return EncodedFrame(rank_of(frame), nominal, fast, frame.fd, pack(frame))


def _fd_bits(frame: CanFrame, bits: int, length: int) -> tuple[int, int]:
    crc_field = FD_CRC_FIELD_BITS[frame.dlc > LARGEST_DLC_WITH_CRC_17]
    everything = length + stuff_bits(bits, length, at_end=False) + crc_field + 1
    if not frame.bit_rate_switch:
        return everything + AFTER_FD_CRC_BITS, 0
    until_switch = length - 8 * len(frame.data) - 5
    nominal = until_switch + stuff_bits(bits >> length - until_switch, until_switch, at_end=False)
    return nominal + AFTER_FD_CRC_BITS, everything - nominal


# Bounds over all frames of one format and length.

def most_classical_bits(data_bytes: int, *, extended: bool) -> int:
    """Bits from SOF to the end of EOF with the worst stuffing: Davis et al. 2007, eq. 1 and 2, less intermission."""
    stuffable = (54 if extended else 34) + 8 * data_bytes
    return stuffable + (stuffable - 1) // 4 + AFTER_CRC_BITS


def most_fd_bits(data_bytes: int, *, extended: bool) -> tuple[int, int]:
    """(nominal, data) bits of the longest CAN FD frame with a bit rate switch, with the worst stuffing."""
    until_switch = 36 if extended else 17
    stuffable = until_switch + 5 + 8 * data_bytes
    everything = stuffable + (stuffable - 2) // 4 + FD_CRC_FIELD_BITS[data_bytes > 16] + 1
    nominal = until_switch + (until_switch - 2) // 4
    return nominal + AFTER_FD_CRC_BITS, everything - nominal
