"""Files that get their final name when they are whole.

A recorder writes `NAME.part` and renames it when it is complete, so a file with its final name can always be read,
whatever ends the process.

Not covered: a loss of power. `fsync` before each rename would cover it; it took 22 of the 87 ms of a 0.2 s run
(`benchmarks/short_runs.py` under cProfile).
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

SUFFIX: Final = ".part"


def part_of(path: Path) -> Path:
    """Return the path at which the file `path` is written until it is whole."""
    return path.with_name(path.name + SUFFIX)


def publish(path: Path) -> None:
    """Rename `part_of(path)` to `path`, replacing a file of that name."""
    part_of(path).replace(path)


def write_whole(path: Path, data: bytes) -> None:
    """Write `data` to `path` so that the file is whole or absent; on OSError neither the file nor its part is left."""
    part = part_of(path)
    try:
        part.write_bytes(data)
        publish(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def reopen_standard_files() -> None:
    """Open the null device as each of the descriptors 0, 1 and 2 that a robot program has closed.

    Otherwise the next file opened would get the number, and with it the output that libraries print.
    """
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)      # the lowest number that is free


class ReservedFile:
    """A small file whose space on the disk is allocated in advance, so that it can be written on a full disk.

    Copy-on-write file systems may still refuse the write.
    """

    def __init__(self, path: Path, size_bytes: int) -> None:
        self._path = path
        self._size_bytes = size_bytes

    def reserve(self) -> None:
        part_of(self._path).write_bytes(b" " * self._size_bytes)

    def update(self, text: bytes) -> None:
        """Write `text`, padded with spaces (JSON allows them), into the reserved space; the name stays `NAME.part`."""
        with part_of(self._path).open("r+b", buffering=0) as file:
            file.write(text.ljust(self._size_bytes))

    def write(self, data: bytes) -> None:
        """Write the file and give it its final name, whether or not its space was reserved."""
        if not part_of(self._path).exists():
            write_whole(self._path, data)
            return
        with part_of(self._path).open("r+b", buffering=0) as file:
            file.write(data)
            file.truncate()
        publish(self._path)
