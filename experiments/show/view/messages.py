"""Messages between a run and the server of its view: JSON, one a line, over a pair of connected sockets.

    run -> server    Start, Scene, Update, Answer, End
    server -> run    Listening or Refused, then Watching, Ask, Command
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal

import msgspec

LinkCounts = tuple[int, int, dict[str, int]]        # place of the link, instant at which the newest frame that arrived
                                                    # was sent [ns] or -1, copies by fate
TimedEvent = tuple[int, str, str, str, int]         # time [ns], node, kind, detail, level


class Start(msgspec.Struct, tag="start"):
    """The server may listen: at `port` for pages, at `foxglove` for Foxglove if that is not None; 0: any free port.

    Behind a TLS door it listens at the Unix socket `behind` instead of a port, for pages of `hosts` ("host:port").
    """

    token: str
    port: int
    foxglove: int | None
    behind: str = ""
    hosts: Sequence[str] = ()


class Scene(msgspec.Struct, tag="scene"):
    """What does not change in the run, as the page's script reads it."""

    scene: dict[str, Any]


class Update(msgspec.Struct, tag="update"):
    """What has changed since the last update, with absolute values, so that one that is lost does no lasting harm."""

    now_ns: int
    speed: float                                # virtual seconds a second of the wall clock, over the last second
    paused: bool
    wanted: float | None                        # speed that was chosen; None: as fast as possible
    links: Sequence[tuple[str, str, str]]       # (medium, sender, receiver) of links with their first copies
    changed: Sequence[LinkCounts]
    at: Mapping[str, Sequence[float | None]]    # by node: x, y [m] and heading [rad] or None
    away: Mapping[str, str]                     # by node that is dead or stands still: a word for it; all of them
    events: Sequence[TimedEvent]                # the latest ones
    events_total: int
    lateness: Mapping[str, int] | None          # in real time: `Pace.totals`
    samples: Mapping[str, Mapping[str, float | None]] = {}     # by node: its signals, if Foxglove is asked for


class Answer(msgspec.Struct, tag="answer"):
    """What became of a command; `fields` has an error text by key of a fault, `error` what concerns none of them."""

    client: int
    request: int
    told: str = ""
    error: str = ""
    fields: dict[str, str] = {}


class End(msgspec.Struct, tag="end"):
    """The run has ended; `words` says how. `report` is the path of report.html, "" without one."""

    words: str
    holds: bool
    problems: Sequence[str]
    folder: str
    report: str = ""


class Listening(msgspec.Struct, tag="listening"):
    port: int
    foxglove: int | None


class Refused(msgspec.Struct, tag="refused"):
    why: str


class Watching(msgspec.Struct, tag="watching"):
    """So many pages are open."""

    pages: int


class Ask(msgspec.Struct, tag="ask"):
    """The server asks for the next update."""


class Command(msgspec.Struct, tag="command"):
    """What a person has asked for in a page; `keys` of a fault have their values as text."""

    client: int
    request: int
    what: Literal["fault", "pause", "go", "speed"]
    kind: str = ""
    keys: dict[str, str] = {}
    speed: float | None = None


ToServer = Start | Scene | Update | Answer | End
ToRun = Listening | Refused | Watching | Ask | Command

to_server: Final = msgspec.json.Decoder(ToServer)
to_run: Final = msgspec.json.Decoder(ToRun)


def line_of(message: ToServer | ToRun) -> bytes:
    return msgspec.json.encode(message) + b"\n"
