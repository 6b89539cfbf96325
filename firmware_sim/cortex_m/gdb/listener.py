"""Waits for gdb on a TCP port of the loopback; it may take any time, as a person has to start gdb."""

from __future__ import annotations

import socket
from typing import Final

from firmware_sim.cortex_m.gdb.wire import Wire
from netem.node.outside_guard import excused

LOOPBACK: Final = "127.0.0.1"


def reserve(port: int) -> socket.socket:
    """Return a socket that keeps `port` for `accept`, of another process too; 0: any free port. Raises OSError."""
    kept = socket.socket()
    try:
        kept.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        kept.bind((LOOPBACK, port))
    except OSError:
        kept.close()
        raise
    return kept


def accept(port: int) -> Wire:
    """Wait for a connection to `port`, which a process of this user has reserved."""
    with excused(), reserve(port) as listener:
        listener.listen(1)
        connection, _ = listener.accept()
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return Wire(connection)
