"""Captures in the pcapng format, written and read: packets with nanoseconds, interface and comment.

    block:  type u32 | length u32 | body, padded to 4 bytes | length u32       in the byte order of the section
    section header 0x0A0D0D0A --> interface description 1, one for each medium --> enhanced packet 6, ...
    option: code u16 | length u16 | value, padded to 4 bytes                    ended by code 0

What is written has one section, little endian, with a resolution of 1 ns (`if_tsresol` 9). Any capture is read whose
packets are Enhanced Packet Blocks, as those of Wireshark and tcpdump are; other blocks are passed over.

Own code, as no library serves: python-pcapng 2.1.1 refuses packets without bytes, and scapy 2.8 writes microseconds
(decision 0049). Source: draft-ietf-opsawg-pcapng-03, sections 3 and 4. Not modelled: Simple Packet Blocks (they have no
time), the obsolete Packet Block, compressed files.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple, Protocol

NS_PER_S: Final = 1_000_000_000
LATEST_NS: Final = (1 << 63) - 1
LONGEST_COMMENT: Final = 65_000         # bytes: the length of an option has 16 bits
LARGEST_BLOCK: Final = 64 << 20         # bytes; larger ones are refused before they are read

SECTION_HEADER: Final = 0x0A0D0D0A
INTERFACE: Final = 1
ENHANCED_PACKET: Final = 6
BYTE_ORDER: Final = 0x1A2B3C4D
END_OF_OPTIONS, COMMENT, USER_APPLICATION, NAME, RESOLUTION = 0, 1, 4, 2, 9
NANOSECONDS: Final = b"\x09"            # 10**-9 s
MICROSECONDS: Final = 6                 # of an interface that does not say


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


class Stream(Protocol):
    def write(self, data: bytes, /) -> object: ...


class PcapngWriter:
    """Writes packets to `stream`; `interfaces` are numbered from 0."""

    def __init__(self, stream: Stream, interfaces: Sequence[Interface]) -> None:
        self._write = stream.write
        self._block(SECTION_HEADER, struct.pack("<IHHq", BYTE_ORDER, 1, 0, -1), (USER_APPLICATION, b"marconet"))
        for interface in interfaces:
            self._block(INTERFACE, struct.pack("<HHI", interface.link_type, 0, 0), (NAME, interface.name.encode()),
                        (RESOLUTION, NANOSECONDS))

    def packet(self, interface: int, time_ns: int, data: bytes, comment: str) -> None:
        """Write one packet; a comment of more than 65 000 bytes is cut."""
        head = struct.pack("<IIIII", interface, time_ns >> 32, time_ns & 0xFFFFFFFF, len(data), len(data))
        self._block(ENHANCED_PACKET, head + _padded(data),
                    (COMMENT, comment.encode()[:LONGEST_COMMENT].decode(errors="ignore").encode()))

    def _block(self, kind: int, body: bytes, *options: tuple[int, bytes]) -> None:
        body += b"".join(struct.pack("<HH", code, len(value)) + _padded(value) for code, value in options if value)
        body += struct.pack("<HH", END_OF_OPTIONS, 0)
        length = struct.pack("<I", len(body) + 12)
        self._write(struct.pack("<I", kind) + length + body + length)


def read_packets(path: Path) -> Iterator[Packet]:
    """Yield the packets of the capture at `path` in the order of the file. Raises BadCapture, OSError."""
    number = 0
    try:
        with path.open("rb") as file:
            for packet in _packets(file):
                number += 1
                yield packet
    except (struct.error, _Damaged) as error:
        raise BadCapture(f"{path}: behind packet {number}: {error}: expected a capture in the pcapng format; `editcap "
                         "-F pcapng IN OUT` converts others, and leaves out what is cut off") from error


class _Damaged(Exception):
    """What is wrong with a block."""


class _Described(NamedTuple):
    interface: Interface
    tick_ns: Fraction


def _packets(file: BinaryIO) -> Iterator[Packet]:
    order = ""                                  # of bytes, as `struct` names it; "" before the first section
    interfaces: list[_Described] = []
    while head := file.read(8):
        if len(head) < 8:
            raise _Damaged(f"{len(head)} bytes of a block")
        if head[:4] == SECTION_HEADER.to_bytes(4, "little"):        # reads the same in both orders
            magic = file.read(4)
            order = {BYTE_ORDER: "<", int.from_bytes(BYTE_ORDER.to_bytes(4, "big"), "little"): ">"}.get(
                int.from_bytes(magic, "little"), "")
            interfaces = []
            if not order:
                raise _Damaged("no byte order in its section header")
            _body(file, head, order, taken=4)
            continue
        if not order:
            raise _Damaged("no section header at its start")
        kind, body = _body(file, head, order)
        if kind == INTERFACE:
            interfaces.append(_interface(body, order, len(interfaces)))
        elif kind == ENHANCED_PACKET:
            yield _packet(body, order, interfaces)


def _body(file: BinaryIO, head: bytes, order: str, taken: int = 0) -> tuple[int, bytes]:
    """Return the type and the rest of the body of a block of which `head` and `taken` more bytes are read."""
    kind, length = struct.unpack(f"{order}II", head)
    rest = length - 12 - taken
    if rest < 0 or length % 4 or length > LARGEST_BLOCK:
        raise _Damaged(f"a block of {length} bytes, expected a multiple of 4 up to {LARGEST_BLOCK}")
    body, end = file.read(rest), file.read(4)
    if len(end) < 4:
        raise _Damaged(f"a block of {length} bytes is cut off")
    if struct.unpack(f"{order}I", end)[0] != length:
        raise _Damaged(f"a block begins with the length {length} and does not end with it")
    return kind, body


def _interface(body: bytes, order: str, number: int) -> _Described:
    link_type, _, _ = struct.unpack_from(f"{order}HHI", body)
    options = _options(body, 8, order)
    resolution = options.get(RESOLUTION, b"")
    power = resolution[0] if resolution else MICROSECONDS
    unit = 2 ** (power & 0x7F) if power & 0x80 else 10**power
    return _Described(Interface(options.get(NAME, str(number).encode()).decode(errors="replace"), link_type),
                      Fraction(NS_PER_S, unit))


def _packet(body: bytes, order: str, interfaces: Sequence[_Described]) -> Packet:
    number, high, low, captured, _ = struct.unpack_from(f"{order}IIIII", body)
    if number >= len(interfaces):
        raise _Damaged(f"interface {number}, of {len(interfaces)}")
    data = body[20:20 + captured]
    if len(data) < captured:
        raise _Damaged(f"{len(data)} bytes of a packet of {captured}")
    (name, link_type), tick_ns = interfaces[number]
    time_ns = int((high << 32 | low) * tick_ns)
    if time_ns > LATEST_NS:
        raise _Damaged(f"a time of {time_ns} ns")
    comment = _options(body, 20 + captured + -captured % 4, order).get(COMMENT, b"")
    return Packet(time_ns, name, link_type, data, comment.decode(errors="replace"))


def _options(body: bytes, at: int, order: str) -> dict[int, bytes]:
    """Return the options from byte `at` on; of several with one code, the first."""
    found: dict[int, bytes] = {}
    while at + 4 <= len(body):
        code, length = struct.unpack_from(f"{order}HH", body, at)
        if code == END_OF_OPTIONS:
            break
        value = body[at + 4:at + 4 + length]
        if len(value) < length:
            raise _Damaged(f"{len(value)} bytes of an option of {length}")
        found.setdefault(code, value)
        at += 4 + length + -length % 4
    return found


def _padded(value: bytes) -> bytes:
    return value + bytes(-len(value) % 4)
