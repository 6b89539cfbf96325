"""A file that grows by whole pieces: what was committed stays readable, whatever happens to the next piece.

    write, write, ... -> memory        commit -> all of it to the disk, or OSError and the file as it was before

After a commit that failed what waits stays in memory, and the next commit tries again. A process that is killed leaves
what was committed, and at most the beginning of one piece behind it.
"""

from __future__ import annotations

import os
from pathlib import Path


class Journal:
    """The file at `path`, made anew; to the libraries that write into it, a binary stream."""

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_CLOEXEC", 0), 0o666)
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
            os.close(self._descriptor)
