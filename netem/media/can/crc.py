"""The checksums of CAN over bits that fill no whole number of bytes (ISO 11898-1:2015, 10.4.2.6).

    CRC-15  0x4599      init 0          classical CAN, over SOF .. data without stuff bits
    CRC-17  0x1685B     init 1 << 16    CAN FD up to 16 bytes of data, over SOF .. data with stuff bits, and stuff count
    CRC-21  0x102899    init 1 << 20    CAN FD beyond

With init 0 leading zeros do not change a checksum, so the bits are padded on the left to whole bytes and processed with
a table. An init of 1 << (width - 1) has the same effect as inverting the first bit.
"""

from __future__ import annotations

from typing import Final


class Crc:
    def __init__(self, width: int, polynomial: int, *, inverts_first_bit: bool = False) -> None:
        """`polynomial`: without its leading term."""
        self.width = width
        self.polynomial = polynomial
        self.inverts_first_bit = inverts_first_bit
        self._table = tuple([self._of_byte(byte) for byte in range(256)])

    def _of_byte(self, byte: int) -> int:
        value = byte << self.width - 8
        for _ in range(8):
            value <<= 1
            if value >> self.width:
                value ^= 1 << self.width | self.polynomial
        return value

    def of(self, bits: int, length: int) -> int:
        """Checksum of `length` bits, of which the first is the most significant."""
        if self.inverts_first_bit:
            bits ^= 1 << length - 1
        table, shift, mask, value = self._table, self.width - 8, (1 << self.width) - 1, 0
        for byte in bits.to_bytes(length + 7 >> 3, "big"):
            value = (value << 8 & mask) ^ table[value >> shift ^ byte]
        return value


CRC_15: Final = Crc(15, 0x4599)
CRC_17: Final = Crc(17, 0x1685B, inverts_first_bit=True)
CRC_21: Final = Crc(21, 0x102899, inverts_first_bit=True)
