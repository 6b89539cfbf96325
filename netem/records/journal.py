"""Journals hold on the disk what a run has recorded so far: pieces of bytes that are readable up to the last whole one.

    piece: length, CRC-32 (both uint32, little endian), then so many bytes, compressed with Zstandard

A file grows by whole commits. After a commit that failed (full disk) it is as it was before, what waits stays in
memory, and the next commit tries again. A process that is killed leaves what it had committed, and at most the
beginning of one piece behind that.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import zstandard

HEADER: Final = struct.Struct("<II")
LEVEL: Final = 1            # a journal lives as long as its run: speed counts


class GrowingFile:
    """The file at `path`, made anew; to libraries that write into it, a binary stream."""

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
        """Nothing: libraries flush where it suits them, the file grows when it is told to."""

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return False

    def commit(self) -> None:
        """Put what waits on the disk. OSError, as for a full disk, leaves the file as it was."""
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
        """Close the file with what was committed."""
        if not self.closed:
            self.closed = True
            if self._is_open():
                os.close(self._descriptor)

    def _is_open(self) -> bool:
        """False if a robot program has closed the file: the number may be that of another one by now."""
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
        """Add a piece, in memory."""
        packed = self._compress(piece)
        self._file.write(HEADER.pack(len(packed), zlib.crc32(packed)))
        self._file.write(packed)

    def commit(self) -> None:
        """Put the pieces added on the disk. OSError, as for a full disk, keeps them for the next commit."""
        self._file.commit()

    def close(self) -> None:
        self._file.close()


def pieces_of(path: Path) -> Iterator[bytes]:
    """The whole pieces of the journal at `path`, in order. FileNotFoundError if there is none."""
    unpack = zstandard.ZstdDecompressor().decompress
    with path.open("rb") as file:
        while len(header := file.read(HEADER.size)) == HEADER.size:
            length, checksum = HEADER.unpack(header)
            packed = file.read(length)
            if len(packed) < length or zlib.crc32(packed) != checksum:
                return
            yield unpack(packed)
