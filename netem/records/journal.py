"""Journals: the records of a run so far, on the disk, as pieces of bytes that are readable up to the last whole one.

    piece: length, CRC-32 (both uint32, little endian), then `length` bytes, compressed with Zstandard

A file grows by whole commits. A commit that fails (full disk) leaves the file unchanged and the data in memory, and the
next commit tries again. If the process is killed, the file holds all commits, followed by at most a part of one piece.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import zstandard

from netem.records.part_file import part_of

HEADER: Final = struct.Struct("<II")
LEVEL: Final = 1            # the fastest: a journal is removed at the end of its run


class GrowingFile:
    """A new file at `path`, as a binary stream for libraries that write into it; it grows only by `commit`."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_CLOEXEC", 0), 0o666)
        self._file = os.fstat(self._descriptor).st_ino
        self._committed = 0
        self._waiting = bytearray()
        self.closed = False

    def write(self, data: bytes) -> int:
        self._waiting += data
        return len(data)

    def tell(self) -> int:
        return self._committed + len(self._waiting)

    def flush(self) -> None:
        """Do nothing, as libraries flush at times of their own."""

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return False

    def commit(self) -> None:
        """Write the data in memory to the disk. On OSError, as for a full disk, the file is unchanged."""
        if not self._waiting:
            return
        if not self._is_open():
            self._descriptor = os.open(self._path, os.O_WRONLY | getattr(os, "O_CLOEXEC", 0))
            os.lseek(self._descriptor, self._committed, os.SEEK_SET)
        written = 0
        try:
            with memoryview(self._waiting) as waiting:
                while written < len(waiting):
                    written += os.write(self._descriptor, waiting[written:])
        except BaseException:
            os.ftruncate(self._descriptor, self._committed)
            os.lseek(self._descriptor, self._committed, os.SEEK_SET)
            raise
        self._committed += written
        self._waiting.clear()

    def close(self) -> None:
        """Close the file; data that was not committed is lost."""
        if not self.closed:
            self.closed = True
            if self._is_open():
                os.close(self._descriptor)

    def _is_open(self) -> bool:
        """Return False if a robot program has closed the descriptor, whose number may belong to another file now."""
        try:
            return os.fstat(self._descriptor).st_ino == self._file
        except OSError:
            return False


class Journal:
    """A growing file of pieces."""

    def __init__(self, path: Path) -> None:
        self._file = GrowingFile(path)
        self._compress = zstandard.ZstdCompressor(level=LEVEL).compress

    def add(self, piece: bytes) -> None:
        """Add a piece; it stays in memory until `commit`."""
        packed = self._compress(piece)
        self._file.write(HEADER.pack(len(packed), zlib.crc32(packed)))
        self._file.write(packed)

    def commit(self) -> None:
        """Write the added pieces to the disk. On OSError, as for a full disk, they wait for the next commit."""
        self._file.commit()

    def close(self) -> None:
        self._file.close()


def journal_of(path: Path) -> Path:
    """Return the path of the journal for the record at `path`; the journal exists until the record is whole."""
    return part_of(path.with_suffix(".rows"))


def pieces_of(path: Path) -> Iterator[bytes]:
    """Yield the whole pieces of the journal at `path`, in order. Raises FileNotFoundError if there is no journal."""
    unpack = zstandard.ZstdDecompressor().decompress
    with path.open("rb") as file:
        while len(header := file.read(HEADER.size)) == HEADER.size:
            length, checksum = HEADER.unpack(header)
            packed = file.read(length)
            if len(packed) < length or zlib.crc32(packed) != checksum:
                return
            yield unpack(packed)
