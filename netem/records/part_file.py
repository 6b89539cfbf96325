"""Files that have their final name only when they are whole.

A record is written to `NAME.part` (or to a stream of its own) and renamed when it is complete, so that a file with its
final name can always be read, whatever ends the process.

Not covered: a loss of power. `fsync` before each rename would cover it; it took 22 of the 87 ms of a 0.2 s run
(`benchmarks/short_runs.py` under cProfile).
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

SUFFIX: Final = ".part"


def part_of(path: Path) -> Path:
    """Where the file at `path` is written before it is whole."""
    return path.with_name(path.name + SUFFIX)


def publish(path: Path) -> None:
    """Give the file at `part_of(path)` its final name, replacing a file of that name."""
    part_of(path).replace(path)


def write_whole(path: Path, data: bytes) -> None:
    """Write `data` to `path` so that the file is there whole or not at all; OSError leaves neither file nor part."""
    part = part_of(path)
    try:
        part.write_bytes(data)
        publish(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def reopen_standard_files() -> None:
    """Let 0, 1 and 2 be the null device where a robot program has closed them: the next file that is opened would get
    their numbers, and with them what libraries print."""
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)      # the lowest number that is free


class ReservedFile:
    """A small file whose space on the disk is taken before it is needed, so that it can be written on a full disk.

    A file system that copies on write may still refuse it.
    """

    def __init__(self, path: Path, size_bytes: int) -> None:
        self._path = path
        self._size_bytes = size_bytes

    def reserve(self) -> None:
        part_of(self._path).write_bytes(b" " * self._size_bytes)

    def update(self, text: bytes) -> None:
        """Say how things stand, in text that may be padded with spaces (JSON). The file keeps its name and space."""
        with part_of(self._path).open("r+b", buffering=0) as file:
            file.write(text.ljust(self._size_bytes))

    def write(self, data: bytes) -> None:
        """Fill the file and give it its final name, whether or not its space was reserved."""
        if not part_of(self._path).exists():
            write_whole(self._path, data)
            return
        with part_of(self._path).open("r+b", buffering=0) as file:
            file.write(data)
            file.truncate()
        publish(self._path)

    def drop(self) -> None:
        """Give the space back without writing the file."""
        part_of(self._path).unlink(missing_ok=True)
