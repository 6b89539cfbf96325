"""Files of blocking programs that become readable in virtual time: sockets, found by their descriptors.

Such a socket owns a real one, which is never bound, connected or written to: so it has a descriptor of its own, options
as the system checks them, and `isinstance(it, socket.socket)` holds.

Differs from the rule against module-level state: descriptors are numbers of the process, and `select` gets only those.
"""

from __future__ import annotations

import errno
import socket
from collections.abc import Callable
from typing import Any, Final, NoReturn
from weakref import WeakValueDictionary

from firmware_sim.blocking.here import running
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.blocking.program_thread import ProgramThread
from firmware_sim.blocking.seconds import duration_ns
from netem.wire.instants import NEVER_NS


class NotInVirtualTime(OSError):
    """A program used a function that marconet does not have in virtual time; the text names it and the remedy."""

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(errno.EOPNOTSUPP, f"{what} is not there in virtual time: {remedy}")


def refuse(what: str, remedy: str) -> NoReturn:
    """Raise `NotInVirtualTime`, and record it as a warning of the node, since programs often catch an OSError."""
    error = NotInVirtualTime(what, remedy)
    program = running()
    if program is not None and ("refused", what) not in program.shared:
        program.shared["refused", what] = True
        program.node.warn("not in virtual time", error.strerror or "")
    raise error


def _refused(name: str, remedy: str) -> Callable[..., Any]:
    def method(self: VirtualSocket, *args: Any, **kwargs: Any) -> NoReturn:
        refuse(f"{self.what}.{name}", remedy)

    return method


class VirtualSocket(socket.socket):
    """A socket that exists in the emulator only.

    Invariants:
    - a thread waits in `watchers` only while it is suspended;
    - `hears` is True if a frame can make it readable, so that a thread that waits for it promises softly.
    """

    what = "socket"
    hears = True

    def __init__(self, program: BlockingProgram, family: int, kind: int, proto: int = 0) -> None:
        self.program = program
        self.watchers: list[ProgramThread] = []
        super().__init__(family, kind, proto)
        FILES[self.fileno()] = self
        program.files.add(self)

    def readable(self) -> bool:
        """Return whether a call that receives would return at once."""
        raise NotImplementedError

    def note_readable(self) -> None:
        """Let the threads that wait for this socket look again."""
        for thread in self.watchers:
            self.program.wake(thread)

    def await_readable(self, flags: int = 0) -> None:
        """Wait until it is readable; raise what a socket with this time-out raises if it is not in time."""
        self.check_here()
        timeout = self.gettimeout()
        if timeout is not None:             # Python waits before it calls the system, which gets the flag
            flags = 0
        at_once = bool(flags & socket.MSG_DONTWAIT)
        wait_ns = None if timeout is None and not at_once else duration_ns(timeout or 0.0)
        program = self.program
        if not self.readable() and wait_ns == 0:
            program.note_call()
            if not self.readable():
                raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")
        if not self.readable():
            until_ns = NEVER_NS if wait_ns is None else program.due_ns(wait_ns)
            thread = program.thread()
            self.watchers.append(thread)
            try:
                while not self.readable():
                    if not program.wait(until_ns, hears=self.hears) and not self.readable():
                        raise TimeoutError("timed out")
            finally:
                self.watchers.remove(thread)
        program.thread().row.end()

    def check_here(self) -> None:
        """Raise OSError if the socket is closed or the calling thread is none of its program."""
        if self.fileno() < 0:
            raise OSError(errno.EBADF, "Bad file descriptor")
        if running() is not self.program:
            raise OSError(errno.EINVAL, f"{self.what} of node {self.program.node.name}: used in a thread that is none "
                                        "of its program; start threads with threading.Thread")

    def leave(self) -> None:
        """Take the socket out of the emulator; it is being closed."""

    def __del__(self) -> None:
        """Close the real socket without the warning of a plain one; nothing is connected to it."""
        if self.fileno() >= 0:
            super()._real_close()               # type: ignore[misc]

    def _real_close(self, _ss: Any = socket.socket.__base__) -> None:
        FILES.pop(self.fileno(), None)
        self.leave()
        super()._real_close(_ss)                # type: ignore[misc]

    def __repr__(self) -> str:
        return f"<{self.what} in virtual time, fd={self.fileno()}>"

    recv: Any
    recvmsg = _refused("recvmsg", "use recv or recvfrom")
    recvmsg_into = _refused("recvmsg_into", "use recv_into or recvfrom_into")
    sendmsg = _refused("sendmsg", "join the parts and use send or sendto")
    sendmsg_afalg = _refused("sendmsg_afalg", "there is no kernel to ask")
    sendfile = _refused("sendfile", "read the file and use send")
    listen = _refused("listen", "there is no TCP; use datagrams")
    accept = _refused("accept", "there is no TCP; use datagrams")
    dup = _refused("dup", "open another socket")
    detach = _refused("detach", "keep the socket object")


FILES: Final[WeakValueDictionary[int, VirtualSocket]] = WeakValueDictionary()
