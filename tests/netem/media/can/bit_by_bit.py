"""A frame as bits, written down a second time from the standard, one bit after the other, as slowly as it reads.

Knows nothing of the emulator's tables: CRC by its shift register, stuffing by looking back, fields by name.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from netem.media.can.frame import CanFrame

FD_DLC = {12: 9, 16: 10, 20: 11, 24: 12, 32: 13, 48: 14, 64: 15}
STUFF_COUNT = {0: "0000", 1: "0011", 2: "0110", 3: "0101", 4: "1100", 5: "1111", 6: "1010", 7: "1001"}


@dataclass
class Bit:
    level: int
    name: str
    fast: bool = False
    stuff: bool = False


def number(value: int, width: int) -> list[int]:
    return [value >> place & 1 for place in reversed(range(width))]


def crc(levels: list[int], width: int, polynomial: int, start: int) -> list[int]:
    register = number(start, width)
    taps = number(polynomial, width)
    for level in levels:
        feedback = level ^ register[0]
        register = [*register[1:], 0]
        if feedback:
            register = [cell ^ tap for cell, tap in zip(register, taps, strict=True)]
    return register


def header(frame: CanFrame) -> Iterator[tuple[int, str]]:
    yield 0, "SOF"
    identifier = number(frame.can_id, 29 if frame.extended else 11)
    for level in identifier[:11]:
        yield level, "ID"
    if frame.extended:
        yield 1, "SRR"
        yield 1, "IDE"
        for level in identifier[11:]:
            yield level, "ID"
    if frame.fd:
        yield 0, "RRS"
        if not frame.extended:
            yield 0, "IDE"
        yield 1, "FDF"
        yield 0, "res"
        yield int(frame.bit_rate_switch), "BRS"
        yield int(frame.error_state), "ESI"
        dlc = FD_DLC.get(len(frame.data), len(frame.data))
    else:
        yield int(frame.remote), "RTR"
        yield 0, "r1" if frame.extended else "IDE"
        yield 0, "r0"
        dlc = frame.dlc if frame.dlc >= 0 else len(frame.data)
    for level in number(dlc, 4):
        yield level, "DLC"
    for byte in frame.data:
        for level in number(byte, 8):
            yield level, "data"


def five_equal(bits: list[Bit]) -> bool:
    """The last five bits on the bus, stuff bits included, are equal and began after the last stuff bit or with it."""
    return len(bits) >= 5 and len({bit.level for bit in bits[-5:]}) == 1 and not any(bit.stuff for bit in bits[-4:])


def encode(frame: CanFrame, *, acknowledged: bool = True) -> list[Bit]:
    """SOF to the end of EOF, as it goes over the bus."""
    plain = list(header(frame))
    bits: list[Bit] = []
    if not frame.fd:
        checked = [level for level, _ in plain]
        plain += [(level, "CRC") for level in crc(checked, 15, 0x4599, 0)]
        for level, name in plain:
            bits.append(Bit(level, name))
            if five_equal(bits):
                bits.append(Bit(1 - level, name, stuff=True))
        fast = False
    else:
        fast, inserted = False, 0
        for place, (level, name) in enumerate(plain):
            bits.append(Bit(level, name, fast))
            fast = fast or (name == "BRS" and level == 1)
            if five_equal(bits) and place < len(plain) - 1:
                bits.append(Bit(1 - level, name, fast, stuff=True))
                inserted += 1
        count = [int(digit) for digit in STUFF_COUNT[inserted % 8]]
        checked = [bit.level for bit in bits] + count
        long = len(frame.data) > 16
        check = crc(checked, 21, 0x102899, 1 << 20) if long else crc(checked, 17, 0x1685B, 1 << 16)
        for place, level in enumerate(count + check):
            if place % 4 == 0:
                bits.append(Bit(1 - bits[-1].level, "CRC", fast, stuff=True))
            bits.append(Bit(level, "CRC", fast))
    bits.append(Bit(1, "CRC delimiter", fast))
    bits.append(Bit(0 if acknowledged else 1, "ACK slot"))
    bits.append(Bit(1, "ACK delimiter"))
    bits.extend(Bit(1, "EOF") for _ in range(7))
    return bits
