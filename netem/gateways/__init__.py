"""Gateways: runs in real time, in which devices and programs outside the run take part in a medium.

A member of this kind is a `Gateway` with a settings class, and a line in the table (table.py). It is on a medium like a
node: it sends on the medium the messages that it receives from outside, and sends outside the frames that reach it, at
the pace of the wall clock. The run builds it as `Member(name, medium, settings, event=..., longest_bytes=...)`.

The loop that waits for the wall clock (pace.py) calls `arrivals` whenever the descriptor `fileno()` can be read, and at
the instant `due_ns()`. A gateway with several files gives the descriptor of a selector of its own; one that connects
again after a while gives the instant of its next attempt.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, ClassVar, Final, NamedTuple, Protocol

from netem.gateways.allowance import Allowance
from netem.wire.instants import NEVER_NS
from netem.wire.level import Level


class Arrival(NamedTuple):
    """A message from outside, and when it arrived, by the clock of `time.monotonic_ns`."""

    at_ns: int
    data: bytes


Tell = Callable[[str, str, Level], None]        # (kind, detail, level) of an event

SPEAKS: Final = "gateway peer"                  # kinds of events: somebody outside takes part,
GONE: Final = "gateway peer gone"               # has left,
REFUSED: Final = "gateway peer refused"         # or may not take part
LOST: Final = "gateway lost"                    # a device or server is there no more,
MISSING: Final = "gateway not connected"        # or not there yet
FLOODED: Final = "gateway flooded"              # somebody sends more than is taken
GARBAGE: Final = "gateway garbage"              # bytes that are no message
UNREAD: Final = "gateway peer does not read"    # what is sent to it piles up


def tell_nobody(kind: str, detail: str, level: Level) -> None:
    """Drop an event."""


class Datagrams(Protocol):
    """How a medium carries the datagrams of a network library; `longest_bytes` of one, None: no limit."""

    @property
    def longest_bytes(self) -> int | None: ...

    def enclose(self, destination: str | None, payload: bytes) -> bytes:
        """Return the frame that takes `payload` to a node, None: to all."""

    def payload_of(self, frame: bytes) -> bytes | None:
        """Return what a frame carries, None if it is no datagram."""


class Attends(Protocol):
    """Decides when the time of a run passes, and watches sockets while it does not.

    `Pace` does so in a run in real time, `Steering` in a run in virtual time with a view.
    """

    def attend(self, file: Any, call: Callable[[], None]) -> None:
        """Call `call`, from now on, whenever the socket `file` can be read."""

    def leave(self, file: Any) -> None:
        """Stop watching `file`."""


class Door(NamedTuple):
    """A TLS door that the run's front opens: at `listen` ("host:port"), for `most` streams at a time.

    Who comes through has a certificate whose common name is in `admits`, and an address in `only_from`, () for any.
    """

    listen: str
    admits: tuple[str, ...]
    only_from: tuple[str, ...] = ()
    most: int = 32


class GatewaySettings:
    """Questions that the settings of every kind of gateway answer before the run, with defaults."""

    def occupies(self) -> Collection[str]:
        """Return the addresses or devices that no other gateway of the run can have, as text for an error."""
        return ()

    def door(self, name: str) -> Door | None:
        """Return the TLS door that the gateway `name` needs, None if it listens by itself or not at all."""
        return None

    def refusal(self, *, carries_can_frames: bool, datagrams: Datagrams | None) -> str:
        """Return why the gateway cannot be on its medium, with a remedy; "" if it can."""
        return ""


class Gateway:
    """Base class of all gateways.

    `event` records what happens to the gateway; `longest_bytes` is the longest frame that the medium takes, None if
    there is no limit. `clock_ns` is the wall clock of `due_ns`, that of `time.monotonic_ns`.
    """

    Settings: ClassVar[type[Any]] = GatewaySettings

    def __init__(self, name: str, medium: str, settings: Any, *, event: Tell = tell_nobody,
                 longest_bytes: int | None = None, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self.name = name
        self.medium = medium
        self.settings = settings
        self.longest_bytes = longest_bytes
        self._event, self._clock_ns = event, clock_ns

    def join(self, names: Sequence[str], datagrams: Datagrams | None) -> None:
        """Note the names of all nodes of the run and how the medium carries datagrams; called once, before the run."""

    def onward(self) -> str:
        """Return where the run's front is to pass the streams of the door, "unix/PATH" or "tcp/HOST:PORT"."""
        raise NotImplementedError

    def opened(self, door: Any) -> None:
        """Note the door (`tls_front.OpenedDoor`) that the run's front has opened for this gateway."""

    def fileno(self) -> int:
        """Return the descriptor that becomes readable when there is something to receive; it stays the same."""
        raise NotImplementedError

    def due_ns(self) -> int:
        """Return the instant of the wall clock at which `arrivals` is to be called though the descriptor is silent."""
        return NEVER_NS

    def receive(self, most: int) -> list[bytes]:
        """Return at most `most` of the messages that have arrived, oldest first; never block, never raise for bytes."""
        raise NotImplementedError

    def arrivals(self, most: int) -> list[Arrival]:
        """Do what `receive` does, and tell when each message arrived: now, unless the system knows better."""
        found = self.receive(most)
        now_ns = self._clock_ns()
        return [Arrival(now_ns, data) for data in found]

    def send(self, data: bytes) -> None:
        """Send `data` outside; drop and count it if it cannot be sent now."""
        raise NotImplementedError

    def counters(self) -> Mapping[str, int]:
        """Return the numbers of messages received, refused, sent and not sent, under names for `run.json`."""
        return {}

    def alone(self) -> str:
        """Return that no program outside has spoken with the gateway so far, with its address; "" if one has."""
        return ""

    def close(self) -> None:
        """Close all files; called once, at the end of the run."""

    def tell(self, kind: str, text: str, level: Level = Level.WARNING) -> None:
        """Record an event whose detail names this gateway."""
        self._event(kind, f"gateways.{self.name} {text}", level)

    def tell_flood(self, allowance: Allowance, text: str) -> None:
        """Record, once for each allowance, that somebody sends more than it: `text` says who, how much, the remedy."""
        if not allowance.told:
            allowance.told = True
            self.tell(FLOODED, f"is flooded: {text}")
