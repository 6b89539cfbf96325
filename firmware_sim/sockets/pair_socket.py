"""One end of `socket.socketpair()` in a blocking program: bytes or datagrams to the other end, within the program.

Its buffer has no limit, so sending never waits. A wait for such a socket is none for a frame: the promise stays firm.
"""

from __future__ import annotations

import errno
import os
import socket
from collections import deque
from typing import Any

from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.sockets.virtual_files import VirtualSocket


class PairSocket(VirtualSocket):
    what = "a socket of a pair"
    hears = False

    def __init__(self, program: BlockingProgram, kind: int) -> None:
        self._parts: deque[bytes] = deque()
        self._ended = False                     # the other end is closed or shut
        self._other: PairSocket | None = None
        self._stream = not kind & socket.SOCK_DGRAM
        super().__init__(program, socket.AF_UNIX, kind)

    @classmethod
    def pair(cls, program: BlockingProgram, kind: int) -> tuple[PairSocket, PairSocket]:
        here, there = cls(program, kind), cls(program, kind)
        here._other, there._other = there, here
        return here, there

    def readable(self) -> bool:
        return bool(self._parts) or self._ended

    def send(self, data: Any, flags: int = 0) -> int:
        self.check_here()
        found = bytes(memoryview(data))
        if self._other is None:
            raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))
        if found or not self._stream:
            self._other._parts.append(found)
            self._other.note_readable()
        return len(found)

    def sendall(self, data: Any, flags: int = 0) -> None:
        self.send(data, flags)

    def recv(self, bufsize: int, flags: int = 0) -> bytes:
        self.await_readable(flags)
        if not self._parts:
            return b""
        data = b"".join(self._parts) if self._stream else self._parts[0]
        found = data[:bufsize]
        if not flags & socket.MSG_PEEK:
            if self._stream:
                self._parts.clear()
                if rest := data[bufsize:]:
                    self._parts.append(rest)
            else:
                self._parts.popleft()
        return found

    def recv_into(self, buffer: Any, nbytes: int = 0, flags: int = 0) -> int:
        view = memoryview(buffer).cast("B")
        data = self.recv(nbytes or len(view), flags)
        view[:len(data)] = data
        return len(data)

    def recvfrom(self, bufsize: int, flags: int = 0) -> tuple[bytes, Any]:
        return self.recv(bufsize, flags), None

    def getsockname(self) -> str:
        return ""

    def getpeername(self) -> str:
        return ""

    def shutdown(self, how: int) -> None:
        self.check_here()
        if how in (socket.SHUT_WR, socket.SHUT_RDWR):
            other, self._other = self._other, None
            if other is not None:
                other._end()
        if how in (socket.SHUT_RD, socket.SHUT_RDWR):
            self._end()

    def leave(self) -> None:
        other, self._other = self._other, None
        if other is not None:
            other._other = None
            other._end()

    def _end(self) -> None:
        """Let reading from here come to an end, after what is there already."""
        self._ended = True
        self.note_readable()
