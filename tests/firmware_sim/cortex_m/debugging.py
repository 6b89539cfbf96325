"""A node whose emulated processor waits for a debugger, in a thread; as debuggers gdb itself, and single packets."""

from __future__ import annotations

import shutil
import socket
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from firmware_sim.cortex_m.gdb.listener import reserve
from netem.wire.messages import Grant, NodeFault, Report
from tests.firmware_sim.cortex_m.boards import ARRIVAL, board_node

GDB = "gdb-multiarch"
WITHIN_S = 60.0
needs_gdb = pytest.mark.skipif(shutil.which(GDB) is None, reason=f"needs {GDB}: apt-get install gdb-multiarch")


class DebuggedNode:
    """`ended()` returns the report of the node's last grant, up to `until_ns`, or raises what its program raised."""

    def __init__(self, image: Path, port: int, grant: Grant, settings: dict[str, Any]) -> None:
        self.image, self.port = image, port
        self._grant = grant
        self._settings = settings
        self._outcome: Any = None
        self._clients: list[Packets] = []
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        try:
            node = board_node(self.image, debug_port=self.port, **self._settings)
            try:
                self._outcome = node.advance(self._grant)
            finally:
                node.close()
        except Exception as error:
            self._outcome = error

    def client(self) -> Packets:
        """Return a debugger, connected; it is gone at the end of the `with` block."""
        self._clients.append(Packets(self.port))
        return self._clients[-1]

    def close(self) -> None:
        for client in self._clients:
            client.socket.close()

    def ended(self) -> Report:
        self._thread.join(WITHIN_S)
        assert not self._thread.is_alive(), "the node still waits for its debugger"
        if isinstance(self._outcome, Exception):
            raise self._outcome
        assert isinstance(self._outcome, Report)
        return self._outcome


@contextmanager
def debugged(image: Path, until_ns: int = 100_000_000, arrivals: list[ARRIVAL] | None = None,
             faults: list[NodeFault] | None = None, **settings: Any) -> Iterator[DebuggedNode]:
    with reserve(0) as reserved:
        node = DebuggedNode(image, reserved.getsockname()[1],
                            Grant(1, until_ns, False, True, arrivals or [], faults or []), settings)
        try:
            yield node
        finally:
            node.close()
            node.ended()


def gdb(node: DebuggedNode, *commands: str) -> str:
    """Return what gdb prints while it carries out the commands."""
    given = ["set pagination off", f"target remote 127.0.0.1:{node.port}", *commands]
    done = subprocess.run([GDB, "-q", "-nx", "-batch", *(word for line in given for word in ("-ex", line)),
                           str(node.image)], capture_output=True, text=True, timeout=WITHIN_S)
    return done.stdout + done.stderr


class Packets:
    """A debugger that sends single packets."""

    def __init__(self, port: int) -> None:
        self.socket = socket.socket()
        while self.socket.connect_ex(("127.0.0.1", port)):      # until the node listens
            pass
        self.socket.settimeout(WITHIN_S)
        self._arrived = b""

    def send(self, packet: bytes) -> None:
        self.socket.sendall(b"$%b#%02x" % (packet, sum(packet) & 0xFF))

    def ask(self, packet: bytes) -> bytes:
        self.send(packet)
        return self.answer()

    def answer(self) -> bytes:
        """Return the next packet, b"" at the end of the connection."""
        while b"#" not in self._arrived or len(self._arrived) < self._arrived.index(b"#") + 3:
            data = self.socket.recv(4096)
            if not data:
                return b""
            self._arrived += data
        packet, _, rest = self._arrived.partition(b"#")
        self._arrived = rest[2:]
        return packet.partition(b"$")[2]
