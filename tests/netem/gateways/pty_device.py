"""The far end of a serial line for tests of gateways."""

from __future__ import annotations

import os
import tty
from pathlib import Path


class Device:
    """The far end of a serial device: a pseudo-terminal of the test, whose slave has the name `path`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.plug_in()

    def plug_in(self) -> None:
        self.master, slave = os.openpty()
        tty.setraw(slave)
        os.symlink(os.ttyname(slave), self.path)
        os.close(slave)

    def pull_out(self) -> None:
        self.path.unlink()
        os.close(self.master)

    def said(self, count: int) -> bytes:
        """Return the next `count` bytes that came over the line, after a wait for them."""
        found = b""
        while len(found) < count:
            found += os.read(self.master, count - len(found))
        return found
