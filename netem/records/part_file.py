"""Files that have their final name only when they are whole.

A record is written to `NAME.part` (or to a stream of its own) and renamed when it is complete, so that a file with its
final name can always be read. `fsync` before the rename keeps that order over a loss of power.
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
    part = part_of(path)
    with part.open("rb") as file:
        os.fsync(file.fileno())
    part.replace(path)


def write_whole(path: Path, data: bytes) -> None:
    """Write `data` to `path` so that the file is there whole or not at all; OSError leaves neither file nor part."""
    part = part_of(path)
    try:
        part.write_bytes(data)
        publish(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


class ReservedFile:
    """A small file whose space on the disk is taken before it is needed, so that it can be written on a full disk.

    A file system that copies on write may still refuse it, and one that cannot reserve is written like any other.
    """

    def __init__(self, path: Path, size_bytes: int) -> None:
        self._path = path
        with part_of(path).open("wb") as file:
            try:
                os.posix_fallocate(file.fileno(), 0, size_bytes)
            except (AttributeError, OSError):
                file.write(b" " * size_bytes)       # not every platform and file system can reserve; JSON may be padded

    def write(self, data: bytes) -> None:
        """Fill the file and give it its final name."""
        with part_of(self._path).open("r+b") as file:
            file.write(data)
            file.truncate()
        publish(self._path)

    def drop(self) -> None:
        """Give the space back without writing the file."""
        part_of(self._path).unlink(missing_ok=True)
