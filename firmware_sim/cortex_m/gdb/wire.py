"""Packets of gdb's remote serial protocol on a TCP connection.

    $data#checksum      answered by + or, if the checksum is wrong, -, until both sides agree to do without
    0x03                Ctrl-C of the user, outside of packets

Bytes that are no packet are dropped; nothing that arrives raises an error. The connection is over when the other side
closes it, or sends more than `LONGEST_PACKET` bytes that end no packet.
"""

from __future__ import annotations

import select
import socket
from contextlib import suppress
from typing import Final

LONGEST_PACKET: Final = 16384
INTERRUPT: Final = b"\x03"
ESCAPED: Final = frozenset(b"$#}*")


class Wire:
    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._arrived = bytearray()
        self._acknowledges = True
        self.closed = False

    def stop_acknowledging(self) -> None:
        """The other side has asked to do without + and -."""
        self._acknowledges = False

    def receive(self) -> bytes:
        """Wait for a packet and return its data, or INTERRUPT; b"" if the connection is over."""
        while not self.closed:
            if (packet := self._taken()) is not None:
                return packet
            self._read()
        return b""

    def interrupted(self) -> bool:
        """Return whether the user has pressed Ctrl-C, without waiting; packets that arrive meanwhile are dropped."""
        while not self.closed and select.select([self._connection], [], [], 0)[0]:
            self._read()
        found = False
        while (packet := self._taken()) is not None:
            found = found or packet == INTERRUPT
        return found

    def send(self, data: bytes) -> None:
        escaped = bytearray()
        for byte in data:
            escaped += bytes((0x7D, byte ^ 0x20)) if byte in ESCAPED else bytes((byte,))
        self._write(b"$%b#%02x" % (bytes(escaped), sum(escaped) & 0xFF))

    def close(self) -> None:
        self.closed = True
        with suppress(OSError):
            self._connection.shutdown(socket.SHUT_WR)
        with suppress(OSError):
            self._connection.close()

    def _write(self, data: bytes) -> None:
        try:
            self._connection.sendall(data)
        except OSError:
            self.close()

    def _read(self) -> None:
        try:
            data = self._connection.recv(4096)
        except OSError:
            data = b""
        self._arrived += data
        if not data or len(self._arrived) > LONGEST_PACKET:
            self.close()

    def _taken(self) -> bytes | None:
        """Take the first packet or INTERRUPT out of what has arrived; None if there is no whole one."""
        while self._arrived:
            if self._arrived[0] == INTERRUPT[0]:
                del self._arrived[0]
                return INTERRUPT
            if self._arrived[0] != ord("$"):
                del self._arrived[0]            # + and - of the other side, and noise
                continue
            end = self._arrived.find(b"#")
            if end < 0 or len(self._arrived) < end + 3:
                return None
            raw, told = bytes(self._arrived[1:end]), bytes(self._arrived[end + 1:end + 3])
            del self._arrived[:end + 3]
            right = told.lower() == b"%02x" % (sum(raw) & 0xFF)
            if self._acknowledges:
                self._write(b"+" if right else b"-")
            if right and raw:
                return _unescaped(raw)
        return None


def _unescaped(raw: bytes) -> bytes:
    if b"}" not in raw:
        return raw
    data, escape = bytearray(), False
    for byte in raw:
        if not escape and byte == 0x7D:
            escape = True
        else:
            data.append(byte ^ 0x20 if escape else byte)
            escape = False
    return bytes(data)
