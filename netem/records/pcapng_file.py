"""Captures in the pcapng format, written and read with python-pcapng: packets with nanoseconds, interface and comment.

A file has one section, with an interface for each medium; its resolution is 1 ns (`if_tsresol` 9). Reading takes any
capture whose packets are Enhanced Packet Blocks, as those of Wireshark and tcpdump are.

Source: draft-ietf-opsawg-pcapng. Not modelled: Simple Packet Blocks (they have no time), the obsolete Packet Block.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, BinaryIO, Final, NamedTuple

import pcapng
from pcapng import blocks
from pcapng.exceptions import PcapngException

NS_PER_S: Final = 1_000_000_000
LONGEST_COMMENT: Final = 65_000         # bytes: an option's length has 16 bits
LARGEST_BLOCK: Final = 64 << 20         # bytes; larger ones are refused before they are read
NANOSECONDS: Final = b"\x09"            # 10**-9 s


class Interface(NamedTuple):
    name: str
    link_type: int


class Packet(NamedTuple):
    time_ns: int                # since 1970-01-01, rounded down
    interface: str
    link_type: int
    data: bytes
    comment: str


class BadCapture(ValueError):
    """A file that is no capture in the pcapng format, or a damaged one."""

    exit_code = 2


class PcapngWriter:
    """Writes packets to `stream`; `interfaces` are numbered from 0."""

    def __init__(self, stream: Any, interfaces: Sequence[Interface]) -> None:
        self._section = blocks.SectionHeader(options={"shb_userappl": "marconet"})
        for interface in interfaces:
            self._section.new_member(blocks.InterfaceDescription, link_type=interface.link_type,
                                     options={"if_name": interface.name, "if_tsresol": NANOSECONDS})
        self._writer = pcapng.FileWriter(stream, self._section)

    def packet(self, interface: int, time_ns: int, data: bytes, comment: str) -> None:
        """Write one packet; a comment of more than 65 000 bytes is cut."""
        packet = self._section.new_member(
            blocks.EnhancedPacket, interface_id=interface, timestamp_high=time_ns >> 32,
            timestamp_low=time_ns & 0xFFFFFFFF, packet_len=len(data), packet_data=data,
            options={"opt_comment": comment.encode()[:LONGEST_COMMENT].decode(errors="ignore")})
        self._writer.write_block(packet)


def read_packets(path: Path) -> Iterator[Packet]:
    """Yield the packets of the capture at `path` in the order of the file. Raises BadCapture, OSError."""
    number = 0
    try:
        with path.open("rb") as file:
            scanner = pcapng.FileScanner(_Guarded(file))
            for block in scanner:
                if isinstance(block, blocks.EnhancedPacket):
                    number += 1
                    yield _packet(block)
    except (PcapngException, struct.error, ValueError, KeyError, TypeError, IndexError, OverflowError, ArithmeticError) as error:
        why = str(error) or type(error).__name__
        raise BadCapture(f"{path}: behind packet {number}: {why}: expected a capture in the pcapng format; `editcap -F "
                         f"pcapng IN OUT` converts others, and leaves out what is cut off") from error


def _packet(block: Any) -> Packet:
    interface = block.interface
    ticks = (block.timestamp_high << 32) | block.timestamp_low
    resolution = interface.options["if_tsresol"] if "if_tsresol" in interface.options else b"\x06"
    power = resolution[0] & 0x7F
    unit = Fraction(1, 2**power if resolution[0] & 0x80 else 10**power)
    name = str(interface.options["if_name"]) if "if_name" in interface.options else str(block.interface_id)
    comment = str(block.options["opt_comment"]) if "opt_comment" in block.options else ""
    return Packet(int(ticks * unit * NS_PER_S), name, interface.link_type, bytes(block.packet_data), comment)


class _Guarded:
    """A stream that refuses to read more at once than a block may have, so that a wrong length costs no memory."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def read(self, size: int = -1) -> bytes:
        if not 0 <= size <= LARGEST_BLOCK:
            raise ValueError(f"a block of {size} bytes, at most {LARGEST_BLOCK}")
        return self._file.read(size)

    def tell(self) -> int:
        return self._file.tell()
