"""A receiver that decodes the bits of a frame with an error: it checks stuffing, form and checksum by itself.

After a wrong bit a receiver may decode another length and other stuff bits than the sender sent.

    SOF .. data, CRC sequence    stuff error at a sixth equal bit; CAN FD: at a fixed stuff bit equal to the one before
    CRC delimiter                form error if dominant
    ACK slot                     no error of its own
    ACK delimiter                form error if dominant, or the checksum was wrong
"""

from __future__ import annotations

from netem.media.can.frame import FD_LENGTHS

_UNKNOWN = 1 << 30
_STANDARD_FD, _EXTENDED_FD = 14, 33            # place of the bit FDF or r0, r1 in the frame without stuff bits


class Receiver:
    """Takes the bits from SOF on with `sees`; `wrong` is true from the bit on that shows an error."""

    def __init__(self) -> None:
        self.wrong = False
        self._plain: list[str] = []             # the bits without stuff bits
        self._last, self._run = "", 0
        self._stuffed_bits = _UNKNOWN           # number of plain bits with dynamic stuffing
        self._crc_bits = 0                      # length of stuff count and CRC of CAN FD, with fixed stuff bits
        self._crc_seen = 0
        self._after = -1                        # number of bits since the CRC sequence, -1 before its end

    def sees(self, level: str) -> None:
        if self._after >= 0:
            self._see_end(level)
        elif len(self._plain) >= self._stuffed_bits and self._crc_bits:
            self._see_fixed(level)
        else:
            self._see_stuffed(level)

    def _see_stuffed(self, level: str) -> None:
        expected = self._run == 5
        self._run = self._run + 1 if level == self._last else 1
        self._last = level
        if expected:
            self.wrong = self._run > 1
        else:
            self._plain.append(level)
            if self._plain[0] == "1":           # recessive instead of SOF: the receiver takes the bus for idle
                self._plain.clear()
                self._last, self._run = "", 0
            elif self._stuffed_bits == _UNKNOWN:
                self._find_length()
        ended = len(self._plain) == self._stuffed_bits
        if ended and not self._crc_bits and self._run < 5:
            self._after = 0

    def _find_length(self) -> None:
        plain, seen = self._plain, len(self._plain)
        if seen < 14:
            return
        extended = plain[13] == "1"
        fd_place = _EXTENDED_FD if extended else _STANDARD_FD
        if seen <= fd_place:
            return
        fd = plain[fd_place] == "1"
        end = (41 if extended else 22) if fd else (39 if extended else 19)
        if seen != end:
            return
        dlc = int("".join(plain[-4:]), 2)
        if fd:
            self._stuffed_bits = end + 8 * FD_LENGTHS[dlc]
            self._crc_bits = 27 if FD_LENGTHS[dlc] <= 16 else 32
        else:
            remote = plain[32 if extended else 12] == "1"
            self._stuffed_bits = end + (0 if remote else 8 * min(dlc, 8)) + 15

    def _see_fixed(self, level: str) -> None:
        if self._crc_seen % 5 == 0 and level == self._last:
            self.wrong = True
        self._last = level
        self._crc_seen += 1
        if self._crc_seen == self._crc_bits:
            self._after = 0

    def _see_end(self, level: str) -> None:
        self._after += 1
        if self._after == 1:
            self.wrong = level == "0"
        elif self._after == 3:
            self.wrong = True                   # dominant, or the checksum fails
