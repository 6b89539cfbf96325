"""A Unix socket behind a TLS door, which no other user of this machine can reach."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path


class PrivateSocket:
    """A path for a Unix socket in a folder that only this user may open, at `path`."""

    def __init__(self) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="marconet-"))
        self.path = self._folder / "door"

    def close(self) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)
