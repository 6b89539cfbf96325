"""The process of all TLS doors of a run: `python -m netem.gateways.tls_front_process FILE_DESCRIPTOR`.

    client --accept, only_from--> TLS handshake --common name, room?--> stream <--both ways--> local address

A stream is passed on until either side closes it; who sends faster than the other side reads is made to wait. A client
that asks for the protocol "marconet-check" in its handshake gets one line, "welcome NAME" or "refused: why", and its
connection is closed.

Invariants:
- nothing is passed on before the handshake and the check of the common name;
- a door has at most MOST_IN_HANDSHAKE handshakes under way, each for HANDSHAKE_WITHIN_S at most; further connections
  wait in the system's queue;
- each connection that is not let in counts as refused, whatever it sends.
"""

from __future__ import annotations

import asyncio
import os
import socket
import ssl
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from netem.gateways.addresses import Address, OnlyFrom, address_of, family_of, text_of
from netem.gateways.certificates import CHECK, Certificates, common_name, why_refused
from netem.gateways.door_messages import Came, Left, NotOpened, OpenDoor, Opened, Refused, ToRun, line_of, to_front
from netem.wire.side_process_work import line_from, serve

HANDSHAKE_WITHIN_S: Final = 5.0
GOODBYE_WITHIN_S: Final = 2.0
ONWARD_WITHIN_S: Final = 5.0
MOST_IN_HANDSHAKE: Final = 32       # of one door
ACCEPT_AGAIN_S: Final = 0.1         # after the system had no file or memory for a connection
MOST_UNTOLD_BYTES: Final = 1 << 20  # that wait for the run; a message beyond is left out


class Half(asyncio.Protocol):
    """One side of a stream. It reads once it is joined with the other side."""

    def __init__(self) -> None:
        self.lost: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.transport: Any = None
        self._other: Half | None = None

    def join(self, other: Half) -> None:
        """Pass on what comes from now on."""
        self._other = other
        if self.lost.done():
            other.transport.close()
        else:
            self.transport.resume_reading()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport
        self.transport.pause_reading()

    def data_received(self, data: bytes) -> None:
        if self._other is not None:
            self._other.transport.write(data)

    def pause_writing(self) -> None:
        if self._other is not None:
            self._other.transport.pause_reading()

    def resume_writing(self) -> None:
        if self._other is not None:
            self._other.transport.resume_reading()

    def connection_lost(self, error: Exception | None) -> None:
        self.lost.set_result(None)
        if self._other is not None:
            self._other.transport.close()


class Front:
    def __init__(self, run: asyncio.StreamWriter) -> None:
        self._run = run
        self._contexts: dict[str, ssl.SSLContext] = {}
        self._doors: list[FrontDoor] = []

    def open(self, asked: OpenDoor) -> None:
        try:
            if asked.folder not in self._contexts:
                self._contexts[asked.folder] = Certificates(Path(asked.folder)).server_context()
            door = FrontDoor(self, asked, self._contexts[asked.folder])
        except OSError as error:
            self.tell(NotOpened(asked.number, os.strerror(error.errno) if error.errno else str(error)))
        except ValueError as error:         # certificates that have changed since the scenario was checked
            self.tell(NotOpened(asked.number, str(error)))
        else:
            self._doors.append(door)
            self.tell(Opened(asked.number, door.port))

    def tell(self, message: ToRun) -> None:
        if self._run.transport.get_write_buffer_size() < MOST_UNTOLD_BYTES:
            self._run.write(line_of(message))

    def close(self) -> None:
        for door in self._doors:
            door.close()


class FrontDoor:
    """Raises OSError if it cannot listen."""

    def __init__(self, front: Front, asked: OpenDoor, context: ssl.SSLContext) -> None:
        self._front, self._asked, self._context = front, asked, context
        self._only_from = OnlyFrom(asked.only_from)
        self._refused = self._inside = 0
        self._handshakes = asyncio.Semaphore(MOST_IN_HANDSHAKE)
        self._tasks: set[asyncio.Task[None]] = set()
        address = address_of(asked.listen)
        self._socket = socket.socket(family_of(address), socket.SOCK_STREAM)
        try:
            self._socket.setblocking(False)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if self._socket.family == socket.AF_INET6:
                self._socket.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            self._socket.bind(address)
            self._socket.listen()
        except OSError:
            self._socket.close()
            raise
        self.port: int = self._socket.getsockname()[1]
        self._begin(self._accept())

    def close(self) -> None:
        for task in self._tasks:
            task.cancel()
        self._socket.close()

    def _begin(self, work: Any) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _accept(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            await self._handshakes.acquire()
            try:
                connection, address = await loop.sock_accept(self._socket)
            except OSError:                 # the client has gone, or the system has no more files
                self._handshakes.release()
                await asyncio.sleep(ACCEPT_AGAIN_S)
                continue
            if self._only_from.admits(address[0]):
                self._begin(self._attend(connection, address))
                continue
            self._handshakes.release()
            connection.close()
            self._refuse(address, f"it is not among only_from = {list(self._asked.only_from)}; add its address there "
                         "if it is to take part")

    async def _attend(self, connection: socket.socket, address: Address) -> None:
        try:
            outer = await self._shake_hands(connection, address)
        finally:
            self._handshakes.release()
        if outer is not None:
            try:
                await self._let_in(outer, address)
            finally:
                outer.transport.abort()

    async def _shake_hands(self, connection: socket.socket, address: Address) -> Half | None:
        """Return the client's side of the stream after the handshake; None if it failed."""
        outer = Half()
        try:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)    # else a message may wait 40 ms
            await asyncio.get_running_loop().connect_accepted_socket(
                lambda: outer, connection, ssl=self._context, ssl_handshake_timeout=HANDSHAKE_WITHIN_S,
                ssl_shutdown_timeout=GOODBYE_WITHIN_S)
        except OSError as error:
            connection.close()
            self._refuse(address, why_refused(error))
            return None
        return outer

    async def _let_in(self, outer: Half, address: Address) -> None:
        """Check who it is; answer a client that asks for that, or pass its stream on."""
        shown = outer.transport.get_extra_info("ssl_object")
        name = common_name(shown.getpeercert())
        why, asks = self._why_not(name), shown.selected_alpn_protocol() == CHECK
        if why:
            self._refuse(address, why)
        if asks:
            outer.transport.write((f"refused: {why}\n" if why else f"welcome {name}\n").encode())
        if asks or why:
            outer.transport.close()
            await outer.lost
            return
        self._inside += 1
        try:
            await self._pass_on(outer, address, name)
        finally:
            self._inside -= 1

    def _why_not(self, name: str) -> str:
        admits = " or ".join(f"{each}'s" for each in self._asked.admits) or "nobody's"
        if not name:
            return f"its certificate has not one common name; this door takes {admits}"
        if name not in self._asked.admits:
            return f"its certificate is {name}'s; this door is {admits}"
        if self._inside >= self._asked.most:
            return f"{self._inside} are connected, the most that this door takes; end one, or raise the limit"
        return ""

    async def _pass_on(self, outer: Half, address: Address, name: str) -> None:
        inner, loop = Half(), asyncio.get_running_loop()
        kind, _, place = self._asked.onward.partition("/")
        try:
            async with asyncio.timeout(ONWARD_WITHIN_S):
                if kind == "unix":
                    await loop.create_unix_connection(lambda: inner, place)
                else:
                    host, port = address_of(place)[:2]
                    await loop.create_connection(lambda: inner, host, port)
        except OSError as error:
            self._refuse(address, f"what is behind the door does not answer ({error}); look whether the run still goes")
            return
        self._front.tell(Came(self._asked.number, text_of(address), name))
        try:
            outer.join(inner)
            inner.join(outer)
            await asyncio.wait([outer.lost, inner.lost])
        finally:
            inner.transport.abort()
            self._front.tell(Left(self._asked.number, text_of(address), name))

    def _refuse(self, address: Address, why: str) -> None:
        self._refused += 1
        self._front.tell(Refused(self._asked.number, text_of(address), why, self._refused))


async def _work(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    front = Front(writer)
    try:
        while line := await line_from(reader):
            front.open(to_front.decode(line))
    finally:
        front.close()
        with suppress(ConnectionError):
            await writer.drain()


if __name__ == "__main__":
    serve(_work)
