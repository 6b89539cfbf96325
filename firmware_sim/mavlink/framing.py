"""Finds MAVLink 2 frames in a stream of bytes, and builds them.

    FD, length, incompatible, compatible, sequence, system, component, message id (3), payload, checksum (2)
    [, signature (13)]

    SEARCH --FD--> CANDIDATE --complete, checksum right--> frame
                       |--wrong checksum, unknown flag--> SEARCH behind its first byte

The checksum is CRC-16/MCRF4XX over all bytes after FD up to the payload's end, and one byte that depends on the
message's fields. Only the first byte of a wrong candidate is dropped, so a frame within it is still found. `give_up`
drops an incomplete candidate. A message unknown to the dialect cannot be checked: it is skipped as a whole if another
frame, or nothing, follows it. No bytes raise an exception.

Source: mavlink.io, packet serialization. Not modelled: MAVLink 1 (its frames are noise here).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Final

from firmware_sim.mavlink.dialect import Layout, layout

START: Final = 0xFD
HEADER_BYTES: Final = 10
CHECKSUM_BYTES: Final = 2
SIGNATURE_BYTES: Final = 13
SIGNED: Final = 0x01            # the only incompatibility flag of MAVLink 2


@dataclass(frozen=True, slots=True)
class Frame:
    sequence: int
    system: int
    component: int
    layout: Layout
    payload: bytes
    unsigned: bytes                 # the frame without its signature, over which the signature is computed
    signature: bytes = b""          # link id, timestamp, hash; empty: not signed


@dataclass
class FrameReader:
    """Reads frames; counts noise bytes, bad checksums, unknown flags, unknown messages and incomplete frames."""

    counts: Counter[str] = field(default_factory=Counter)
    _buffer: bytearray = field(default_factory=bytearray)

    def read(self, data: bytes) -> list[Frame]:
        self._buffer += data
        return self._frames()

    @property
    def incomplete(self) -> bool:
        """Whether the buffer holds the beginning of a frame."""
        return bool(self._buffer)

    def give_up(self) -> list[Frame]:
        """Drop the first byte of an incomplete frame, whose rest will not arrive, and read on behind it."""
        if not self._buffer:
            return []
        self.counts["incomplete frames"] += 1
        self._drop(1)
        return self._frames()

    def _frames(self) -> list[Frame]:
        found: list[Frame] = []
        buffer = self._buffer
        while buffer:
            start = buffer.find(START)
            if start != 0:
                self._drop(len(buffer) if start < 0 else start)
                continue
            if len(buffer) < HEADER_BYTES:
                break
            size = HEADER_BYTES + buffer[1] + CHECKSUM_BYTES + (SIGNATURE_BYTES if buffer[2] & SIGNED else 0)
            if buffer[2] & ~SIGNED:
                self.counts["unknown flags"] += 1
                self._drop(1)
            elif len(buffer) < size:
                break
            else:
                self._take(size, found)
        return found

    def _take(self, size: int, found: list[Frame]) -> None:
        buffer = self._buffer
        data = bytes(buffer[:size])
        known = layout(int.from_bytes(data[7:10], "little"))
        if known is None:
            self.counts["unknown messages"] += 1
            if len(buffer) == size or buffer[size] == START:
                del buffer[:size]
            else:
                self._drop(1)
            return
        end = HEADER_BYTES + data[1]
        checksum_end = end + CHECKSUM_BYTES
        if checksum(data[1:end], known.checksum_seed) != int.from_bytes(data[end:checksum_end], "little"):
            self.counts["bad checksums"] += 1
            self._drop(1)
            return
        del buffer[:size]
        found.append(Frame(data[4], data[5], data[6], known, data[HEADER_BYTES:end], data[:checksum_end],
                           data[checksum_end:]))

    def _drop(self, count: int) -> None:
        self.counts["noise bytes"] += count
        del self._buffer[:count]


def build(known: Layout, payload: bytes, sequence: int, system: int, component: int, *, signed: bool = False) -> bytes:
    """Return a frame without its signature; with `signed`, its flag says that a signature follows."""
    head = bytes((len(payload), SIGNED if signed else 0, 0, sequence, system, component))
    body = head + known.id.to_bytes(3, "little") + payload
    return bytes((START,)) + body + checksum(body, known.checksum_seed).to_bytes(2, "little")


def checksum(data: bytes, seed: int) -> int:
    """Return the CRC-16/MCRF4XX of `data` and the byte `seed`."""
    crc = 0xFFFF
    for byte in data:
        crc = (crc >> 8) ^ _TABLE[(crc ^ byte) & 0xFF]
    return (crc >> 8) ^ _TABLE[(crc ^ seed) & 0xFF]


def _table() -> tuple[int, ...]:
    entries = []
    for entry in range(256):
        for _ in range(8):
            entry = entry >> 1 ^ (0x8408 if entry & 1 else 0)
        entries.append(entry)
    return tuple(entries)


_TABLE: Final = _table()
