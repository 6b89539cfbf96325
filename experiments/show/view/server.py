"""The server of a view: `python -m experiments.show.view.server FILE_DESCRIPTOR`, started by the run.

It listens on 127.0.0.1 only, or behind a TLS door at a Unix socket. A page gets the scene, one update with all that has
happened, then each update of the run. Commands of one page are carried out one after another. A page whose updates
pile up is dropped; it connects again by itself and gets all anew.

The process ends when the run says its end, closes the pair of sockets, or ends in any other way.
"""

from __future__ import annotations

import asyncio
import logging
import os
import time
from contextlib import suppress
from http import HTTPStatus
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlsplit

import msgspec
from websockets.asyncio.server import Server, ServerConnection, serve, unix_serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from experiments.show.view.doorkeeper import Doorkeeper
from experiments.show.view.messages import (
    Answer,
    Ask,
    Command,
    End,
    Listening,
    Refused,
    Scene,
    Start,
    Update,
    Watching,
    line_of,
    to_server,
)
from experiments.show.view.page_text import CONTENT_POLICY, page_text
from experiments.show.view.standing import Standing
from netem.wire.side_process_work import line_from
from netem.wire.side_process_work import serve as serve_run

if TYPE_CHECKING:
    from experiments.show.view.foxglove_server import FoxgloveServer

ADDRESS: Final = "127.0.0.1"
ASK_EVERY_S: Final = 0.1
ASK_AGAIN_S: Final = 0.2
MOST_PAGES: Final = 16
MOST_UPDATES_WAITING: Final = 30            # of one page, beside what the system buffers; then it is dropped
LONGEST_COMMAND: Final = 65536              # bytes
GONE_AFTER_S: Final = 3.0                   # without a page until the run is told so: a page may be loaded anew
LAST_WORDS_S: Final = 2.0                   # for the pages to take the end of the run
DECODE_COMMAND: Final = msgspec.json.Decoder(Command)


class Page:
    """One WebSocket. Messages wait in `waiting`; the page is dropped when it is full."""

    def __init__(self, number: int, connection: ServerConnection) -> None:
        self.number, self.connection = number, connection
        self.waiting: asyncio.Queue[bytes] = asyncio.Queue(MOST_UPDATES_WAITING)
        self.answered: asyncio.Queue[Answer] = asyncio.Queue(1)

    def tell(self, message: bytes) -> None:
        try:
            self.waiting.put_nowait(message)
        except asyncio.QueueFull:
            self.connection.transport.abort()

    async def send_all(self) -> None:
        with suppress(ConnectionClosed):
            while True:
                await self.connection.send(await self.waiting.get(), text=True)
                self.waiting.task_done()


class ViewServer:
    def __init__(self, run_in: asyncio.StreamReader, run_out: asyncio.StreamWriter, start: Start) -> None:
        self._in, self._out, self._start = run_in, run_out, start
        self._pages: dict[int, Page] = {}
        self._pages_so_far = 0
        self._standing = Standing()
        self._port = 0                  # behind a TLS door
        self._scene = asyncio.Event()
        self._scene_line = b""
        self._body = page_text().encode()
        self._door = Doorkeeper(start.token, start.port, start.hosts)
        self._updated = asyncio.Event()
        self._told_pages = -1
        self._watched_s = time.monotonic()          # when somebody watched last
        self._foxglove: FoxgloveServer | None = None

    async def run(self) -> None:
        try:
            server = await self._listen()
        except (OSError, ImportError) as error:
            self._tell_run(Refused(_why_not(error, self._start.port)))
            await self._out.drain()
            return
        async with server:
            self._tell_run(Listening(self._port, None if self._foxglove is None else self._foxglove.port))
            tasks = [asyncio.create_task(self._ask()), asyncio.create_task(self._count_pages())]
            try:
                await self._hear_run()
            finally:
                for task in tasks:
                    task.cancel()
                await self._see_off()

    async def _listen(self) -> Server:
        if self._start.foxglove is not None:
            from experiments.show.view.foxglove_server import FoxgloveServer  # late: of an extra

            self._foxglove = FoxgloveServer(self._start.foxglove)
        silent = logging.getLogger("marconet.view")
        silent.addHandler(logging.NullHandler())
        silent.propagate = False
        options: dict[str, Any] = {
            "process_request": self._at_door, "compression": None, "max_size": LONGEST_COMMAND, "max_queue": 4,
            "write_limit": 1 << 16, "close_timeout": 1, "server_header": None, "logger": silent}
        if self._start.behind:
            return await unix_serve(self._attend, self._start.behind, **options)
        server = await serve(self._attend, ADDRESS, self._start.port, **options)
        self._port = next(iter(server.sockets)).getsockname()[1]
        self._door = Doorkeeper(self._start.token, self._port)
        return server

    def _at_door(self, connection: ServerConnection, request: Request) -> Response | None:
        path = urlsplit(request.path).path
        if why := self._door.refusal(request.path, request.headers.get_all("Host"),
                                     request.headers.get_all("Origin")):
            return _response(why[0], f"{why[1]}\n".encode())
        if path == "/":
            return _response(HTTPStatus.OK, self._body, "text/html")
        if path != "/live":
            return _response(HTTPStatus.NOT_FOUND, b"there is nothing here\n")
        if len(self._pages) >= MOST_PAGES:
            return _response(HTTPStatus.SERVICE_UNAVAILABLE, b"too many pages are open: close some\n")
        return None

    async def _attend(self, connection: ServerConnection) -> None:
        """Serve one page until it goes or is dropped."""
        await self._scene.wait()
        self._pages_so_far += 1
        page = Page(self._pages_so_far, connection)
        page.tell(self._scene_line)
        if (whole := self._standing.whole()) is not None:
            page.tell(line_of(whole))
        self._pages[page.number] = page
        self._tell_who_watches()            # at once, as the page may be gone before anybody counts
        sending = asyncio.create_task(page.send_all())
        self._updated.set()
        try:
            async for text in connection:
                await self._command(page, text)
        except ConnectionClosed:
            pass
        finally:
            sending.cancel()
            del self._pages[page.number]

    async def _command(self, page: Page, text: str | bytes) -> None:
        """Pass a command on to the run and wait for its answer, so that there is one at a time from each page."""
        try:
            command = DECODE_COMMAND.decode(text)
        except (msgspec.MsgspecError, UnicodeDecodeError) as error:
            page.tell(line_of(Answer(page.number, -1, error=f"expected a command as JSON: {error}")))
            return
        self._tell_run(msgspec.structs.replace(command, client=page.number))
        page.tell(line_of(await page.answered.get()))

    async def _hear_run(self) -> None:
        ended = False
        while not ended and (line := await line_from(self._in)):
            match to_server.decode(line):
                case Update() as update:
                    self._standing.add(update)
                    if self._foxglove is not None:
                        self._foxglove.update(update)
                    self._tell_pages(line_of(msgspec.structs.replace(update, samples={})))
                    self._updated.set()
                case Scene() as scene:
                    self._scene_line = line
                    if self._foxglove is not None:
                        self._foxglove.show(scene.scene)
                    self._scene.set()
                case Answer() as answer:
                    if (page := self._pages.get(answer.client)) is not None and not page.answered.full():
                        page.answered.put_nowait(answer)
                case End():
                    self._tell_pages(line)
                    ended = True
                case _:
                    pass
        if not ended:
            self._tell_pages(line_of(End("The run was broken off: its process has ended.", False, [], "")))

    async def _ask(self) -> None:
        """Ask for an update every ASK_EVERY_S, and at once if the last one took longer.

        One that does not come is asked for again, as the run sends the rest of a long one when it is asked.
        """
        await self._scene.wait()
        while True:
            if not self._watching():
                await asyncio.sleep(ASK_EVERY_S)
                continue
            asked_s = time.monotonic()
            self._updated.clear()
            self._tell_run(Ask())
            with suppress(TimeoutError):
                async with asyncio.timeout(ASK_AGAIN_S):
                    await self._updated.wait()
            await asyncio.sleep(max(0.0, asked_s + ASK_EVERY_S - time.monotonic()))

    async def _count_pages(self) -> None:
        """Tell the run how many watch: at once if somebody came, after GONE_AFTER_S if the last one went."""
        while True:
            self._tell_who_watches()
            await asyncio.sleep(ASK_EVERY_S / 2)

    def _tell_who_watches(self) -> None:
        watching, now_s = self._watching(), time.monotonic()
        if watching:
            self._watched_s = now_s
        if watching != self._told_pages and (watching or now_s > self._watched_s + GONE_AFTER_S):
            self._told_pages = watching
            self._tell_run(Watching(watching))

    def _watching(self) -> int:
        return len(self._pages) + (0 if self._foxglove is None else self._foxglove.clients)

    def _tell_pages(self, message: bytes) -> None:
        for page in self._pages.values():
            page.tell(message)

    def _tell_run(self, message: Listening | Refused | Watching | Ask | Command) -> None:
        self._out.write(line_of(message))

    async def _see_off(self) -> None:
        """Let the pages take what waits for them, then close them."""
        pages = list(self._pages.values())
        with suppress(TimeoutError):
            async with asyncio.timeout(LAST_WORDS_S):
                await asyncio.gather(*(page.waiting.join() for page in pages))
                await asyncio.gather(*(page.connection.close() for page in pages))
        for page in pages:
            page.connection.transport.abort()
        if self._foxglove is not None:
            self._foxglove.stop()


def _response(status: HTTPStatus, body: bytes, kind: str = "text/plain") -> Response:
    return Response(status, status.phrase, Headers({
        "Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(body)), "Connection": "close",
        "Cache-Control": "no-store", "Referrer-Policy": "no-referrer", "X-Content-Type-Options": "nosniff",
        "X-Frame-Options": "DENY", "Content-Security-Policy": CONTENT_POLICY}), body)


def _why_not(error: Exception, port: int) -> str:
    if isinstance(error, ImportError):
        return "--foxglove: needs the package foxglove-sdk: pip install 'marconet[foxglove]'"
    why = os.strerror(error.errno).lower() if isinstance(error, OSError) and error.errno else str(error)
    return f"--view {port}: cannot listen at 127.0.0.1:{port}: {why}: name another port, or none for any free one"


async def _work(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    if line := await line_from(reader):
        start = to_server.decode(line)
        assert isinstance(start, Start)
        await ViewServer(reader, writer, start).run()


if __name__ == "__main__":
    serve_run(_work)
