"""Messages between a run and its front of TLS doors: JSON, one a line, over a pair of connected sockets.

    run -> front    OpenDoor
    front -> run    Opened or NotOpened, then Came, Left, Refused
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import msgspec


class OpenDoor(msgspec.Struct, tag="open"):
    """Listen at `listen` ("host:port") and pass streams of those with a common name in `admits` on to `onward`.

    `onward` is "unix/PATH" or "tcp/HOST:PORT"; `most` streams at a time; `folder` has the certificates.
    """

    number: int
    folder: str
    name: str                   # whose door it is, as a refused client is told
    listen: str
    onward: str
    admits: Sequence[str]
    only_from: Sequence[str]
    most: int


class Opened(msgspec.Struct, tag="opened"):
    number: int
    port: int


class NotOpened(msgspec.Struct, tag="not opened"):
    number: int
    why: str


class Came(msgspec.Struct, tag="came"):
    """The stream of `peer`, with the certificate of `name`, is passed on."""

    number: int
    peer: str
    name: str


class Left(msgspec.Struct, tag="left"):
    number: int
    peer: str
    name: str


class Refused(msgspec.Struct, tag="refused"):
    """`peer` was not let in; `refused` counts all of this door so far, with those whose message was left out."""

    number: int
    peer: str
    why: str
    refused: int


ToRun = Opened | NotOpened | Came | Left | Refused
to_front: Final = msgspec.json.Decoder(OpenDoor)
to_run: Final = msgspec.json.Decoder(ToRun)


def line_of(message: OpenDoor | ToRun) -> bytes:
    return msgspec.json.encode(message) + b"\n"
