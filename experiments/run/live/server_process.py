"""Starts the server of a view as a process of its own, and exchanges messages with it without ever waiting.

What the server does not take stays in a buffer of this process; no update is made while there is any, so the buffer
holds one update at most.
"""

from __future__ import annotations

import secrets
import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from experiments.show.view.messages import (
    Answer,
    End,
    Listening,
    Refused,
    Scene,
    Start,
    ToRun,
    Update,
    line_of,
    to_run,
)

READY_WITHIN_S: Final = 30.0
ENDS_WITHIN_S: Final = 4.0
AT_ONCE: Final = 65536          # bytes


class NoView(ValueError):
    """The view that was asked for cannot be had; the text says why and what to do."""

    exit_code = 2


class ServerProcess:
    """`url` is the address of the page with its token; `foxglove_url` that for Foxglove, "" if it was not asked for."""

    def __init__(self, port: int, foxglove: int | None) -> None:
        self.socket, other = socket.socketpair()
        with other:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "experiments.show.view.server", str(other.fileno())],
                pass_fds=(other.fileno(),), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        self._heard = bytearray()
        self._unsent = bytearray()
        token = secrets.token_urlsafe(24)
        try:
            ready = self._begin(Start(token, port, foxglove))
        except BaseException:
            self.close(0.0)
            raise
        self.url = f"http://127.0.0.1:{ready.port}/?token={token}"
        self.with_foxglove = ready.foxglove is not None
        self.foxglove_url = f"ws://127.0.0.1:{ready.foxglove}" if self.with_foxglove else ""

    def _begin(self, start: Start) -> Listening:
        self.socket.settimeout(READY_WITHIN_S)
        try:
            self.socket.sendall(line_of(start))
            while b"\n" not in self._heard and (data := self.socket.recv(AT_ONCE)):
                self._heard += data
        except OSError:
            pass
        self.socket.setblocking(False)
        line, _, self._heard = self._heard.partition(b"\n")
        if not line:
            raise NoView("--view: the server of the page did not start: its error is above")
        ready = to_run.decode(line)
        if isinstance(ready, Refused):
            raise NoView(ready.why)
        assert isinstance(ready, Listening)
        return ready

    @property
    def takes_more(self) -> bool:
        """Whether all that was sent has been taken."""
        self._send()
        return not self._unsent

    def send(self, message: Scene | Update | Answer | End) -> None:
        self._unsent += line_of(message)
        self._send()

    def _send(self) -> None:
        with suppress(OSError):             # the server has ended, or takes no more now
            while self._unsent:
                del self._unsent[:self.socket.send(self._unsent)]

    def receive(self) -> list[ToRun] | None:
        """Return the messages that have arrived; None if the server has ended."""
        try:
            data = self.socket.recv(AT_ONCE)
        except BlockingIOError:
            return []
        except OSError:
            return None
        if not data:
            return None
        self._heard += data
        *lines, self._heard = self._heard.split(b"\n")
        return [to_run.decode(line) for line in lines]

    def end(self, holds: bool, problems: Sequence[str], folder: Path) -> None:
        """Tell the pages that the run has come to its end, and what does not hold."""
        self.send(End("everything is as expected" if holds else "not everything is as expected", holds, problems,
                      str(folder)))

    def fail(self, why: str) -> None:
        """Tell the pages what ended the run."""
        self.send(End(why, False, [], ""))

    def close(self, within_s: float = ENDS_WITHIN_S) -> None:
        """Let the server pass on what it has, then end it."""
        with suppress(OSError):
            self.socket.settimeout(within_s)
            self.socket.sendall(self._unsent)
        self.socket.close()
        try:
            self._process.wait(within_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
