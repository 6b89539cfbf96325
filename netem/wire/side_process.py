"""A process that a run starts for itself, and messages with it, a line each, over a pair of connected sockets.

    run: SideProcess(module) --python -m module FILE_DESCRIPTOR--> process: serve(work) (side_process_work.py)

The run never waits for the process, apart from its first line. What the process does not take stays in a buffer. The
process ends when the run closes the pair of sockets or ends in any way.
"""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from contextlib import suppress
from typing import Final

READY_WITHIN_S: Final = 30.0
ENDS_WITHIN_S: Final = 4.0
AT_ONCE: Final = 65536          # bytes


class SideProcess:
    """The run's side; `socket` can be read when the process has said something."""

    def __init__(self, module: str) -> None:
        self.socket, other = socket.socketpair()
        with other:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", module, str(other.fileno())],
                pass_fds=(other.fileno(),), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        self.socket.setblocking(False)
        self._heard = bytearray()
        self._unsent = bytearray()

    def ask(self, line: bytes) -> bytes:
        """Send a line and wait for the next one of the process; b"" if none comes within READY_WITHIN_S."""
        self._unsent += line
        end_s = time.monotonic() + READY_WITHIN_S
        try:
            self.socket.settimeout(READY_WITHIN_S)
            self.socket.sendall(self._unsent)
            self._unsent.clear()
            while b"\n" not in self._heard and (left_s := end_s - time.monotonic()) > 0:
                self.socket.settimeout(left_s)
                if not (data := self.socket.recv(AT_ONCE)):
                    break
                self._heard += data
        except OSError:
            pass
        self.socket.setblocking(False)
        if b"\n" not in self._heard:
            return b""
        answer, _, self._heard = self._heard.partition(b"\n")
        return bytes(answer)

    @property
    def takes_more(self) -> bool:
        """Whether all that was sent has been taken."""
        self._send()
        return not self._unsent

    def send(self, line: bytes) -> None:
        self._unsent += line
        self._send()

    def _send(self) -> None:
        with suppress(OSError):             # the process has ended, or takes no more now
            while self._unsent:
                del self._unsent[:self.socket.send(self._unsent)]

    def receive(self) -> list[bytes] | None:
        """Return the lines that have arrived; None if the process has ended."""
        try:
            data = self.socket.recv(AT_ONCE)
        except BlockingIOError:
            data = b""
            if b"\n" not in self._heard:
                return []
        except OSError:
            return None
        else:
            if not data:
                return None
        self._heard += data
        *lines, self._heard = self._heard.split(b"\n")
        return [bytes(line) for line in lines]

    def close(self, within_s: float = ENDS_WITHIN_S) -> None:
        """Let the process take what it has not taken, then end it."""
        with suppress(OSError):
            self.socket.settimeout(within_s)
            self.socket.sendall(self._unsent)
        self.socket.close()
        try:
            self._process.wait(within_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
