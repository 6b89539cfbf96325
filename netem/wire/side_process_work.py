"""The process's side of a `SideProcess`: an asyncio program that works for one run, and ends with it."""

from __future__ import annotations

import asyncio
import signal
import socket
import sys
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Final

from netem.wire.parent import end_with_parent

LONGEST_LINE: Final = 1 << 26   # bytes of a message of the run

Work = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


def serve(work: Work) -> None:
    """Do `work`, in the process that `SideProcess` started, with the lines of the run; it ends when they end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)        # Ctrl-C is for the run, which then says its end
    end_with_parent(signal.SIGTERM)
    with suppress(ConnectionError):                     # the run has ended
        asyncio.run(_serve(work, socket.socket(fileno=int(sys.argv[1]))))


async def _serve(work: Work, run: socket.socket) -> None:
    reader, writer = await asyncio.open_connection(sock=run, limit=LONGEST_LINE)
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, reader.feed_eof)     # the run is gone
    try:
        await work(reader, writer)
    finally:
        with suppress(OSError):
            writer.close()


async def line_from(run: asyncio.StreamReader) -> bytes:
    """Return the next message of the run; b"" if it has ended, maybe within a message or with some unread."""
    try:
        line = await run.readline()
    except ConnectionError:
        return b""
    return line if line.endswith(b"\n") else b""
