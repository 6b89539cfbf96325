"""A front with doors to a program that echoes, and clients that are not ours, for tests."""

from __future__ import annotations

import selectors
import socket
import ssl
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from netem.gateways import Door
from netem.gateways.certificates import EMULATOR
from netem.gateways.tls_front import OpenedDoor, TlsFront
from netem.wire.level import Level

PATIENCE_S = 30.0


class Echo:
    """A server that sends back what it reads, at `onward`; `reads` False: it reads nothing."""

    def __init__(self, path: Path, *, reads: bool = True) -> None:
        self.onward = f"unix/{path}"
        self.connections: list[socket.socket] = []
        self._server = socket.socket(socket.AF_UNIX)
        self._server.bind(str(path))
        self._server.listen()
        self._reads = reads
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        with suppress(OSError):
            while True:
                self.connections.append(self._server.accept()[0])
                if self._reads:
                    threading.Thread(target=self._echo, args=(self.connections[-1],), daemon=True).start()

    def _echo(self, connection: socket.socket) -> None:
        with suppress(OSError), connection:
            while data := connection.recv(65536):
                connection.sendall(data)

    def close(self) -> None:
        self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()
        for connection in self.connections:
            connection.close()


class Watched:
    """What lets the time of a run pass, here until something is true."""

    def __init__(self) -> None:
        self._selector = selectors.DefaultSelector()

    def attend(self, file: object, call: Callable[[], None]) -> None:
        self._selector.register(file, selectors.EVENT_READ, call)       # type: ignore[arg-type]

    def leave(self, file: object) -> None:
        self._selector.unregister(file)         # type: ignore[arg-type]

    def until(self, true: Callable[[], object]) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while not true():
            assert time.monotonic() < end_s
            for key, _ in self._selector.select(0.01):
                key.data()

    @property
    def watches(self) -> int:
        return len(self._selector.get_map())


class Bench:
    """A front; `told` has the events of each door, by its name."""

    def __init__(self, certificates: Path) -> None:
        self.front = TlsFront(certificates)
        self.told: dict[str, list[tuple[str, str]]] = {}
        self.watched = Watched()

    def open(self, name: str, door: Door, onward: str) -> OpenedDoor:
        told = self.told.setdefault(name, [])

        def tell(kind: str, text: str, level: Level) -> None:
            told.append((kind, text))

        return self.front.open(name, door, onward, tell)

    def begin(self) -> None:
        self.front.begin(self.watched)

    def until_told(self, name: str, kind: str) -> str:
        """Return the text of the first event of this kind that comes, and forget it."""
        def there() -> list[tuple[str, str]]:
            return [each for each in self.told[name] if each[0] == kind]

        self.watched.until(there)
        found = there()[0]
        self.told[name].remove(found)
        return found[1]


def connect(address: str, context: ssl.SSLContext) -> ssl.SSLSocket:
    """Return the connection of a client after its side of the handshake."""
    host, _, port = address.rpartition(":")
    plain = socket.create_connection((host, int(port)), timeout=PATIENCE_S)
    try:
        return context.wrap_socket(plain, server_hostname=EMULATOR)
    except BaseException:
        plain.close()
        raise


def read(connection: socket.socket, count: int) -> bytes:
    found = bytearray()
    while len(found) < count and (data := connection.recv(65536)):
        found += data
    return bytes(found)


def is_closed(connection: socket.socket) -> bool:
    """Return whether the other side closes the connection, after whatever it still sends."""
    with suppress(ConnectionError, ssl.SSLError):
        while connection.recv(65536):
            pass
    return True
