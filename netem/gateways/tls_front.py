"""The front of all TLS doors of a run: one process, which alone meets strangers and reads private keys.

    client --TLS--> front (tls_front_process.py) --a local address--> gateway, view, faults
                          |--who came, went, was refused, and why--> run: events and counts

Python's own TLS says for certain why a handshake failed. A library behind the door (Zenoh) would not say it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

from netem.gateways import GONE, LOST, REFUSED, SPEAKS, Attends, Door
from netem.gateways.addresses import address_of, text_of
from netem.gateways.door_messages import Came, Left, NotOpened, OpenDoor, Opened, Refused, ToRun, line_of, to_run
from netem.wire.level import Level
from netem.wire.side_process import SideProcess

MOST_TOLD: Final = 20               # refusals at a door with an event each; further ones are only counted

Tell = Callable[[str, str, Level], None]        # (kind, text, level): an event of whoever is behind the door


class OpenedDoor:
    """`address` is where it listens, "host:port"; `refused` counts connections that were not let in."""

    def __init__(self, address: str, tell: Tell) -> None:
        self.address = address
        self.refused = 0
        self._tell = tell
        self._told: set[tuple[str, str]] = set()        # (host, why)

    def note(self, message: Came | Left | Refused) -> None:
        match message:
            case Came(peer=peer, name=name):
                self._tell(SPEAKS, f"speaks with {peer}, whose certificate is {name}'s", Level.INFO)
            case Left(peer=peer, name=name):
                self._tell(GONE, f"speaks no more with {peer}, whose certificate is {name}'s", Level.INFO)
            case Refused(peer=peer, why=why):
                self.refused = message.refused
                told = (peer.rpartition(":")[0], why)
                if told not in self._told and len(self._told) < MOST_TOLD:
                    self._told.add(told)
                    self._tell(REFUSED, f"refuses {peer}: {why}", Level.WARNING)

    def end(self) -> None:
        """Note that the front has ended."""
        self._tell(LOST, "cannot be reached any more: the process of the run's TLS doors has ended; run it again",
                   Level.WARNING)


class TlsFront:
    """`folder` has the certificates. The process begins with the first door."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._process: SideProcess | None = None
        self._doors: list[OpenedDoor] = []
        self._early: list[ToRun] = []           # messages that came while a door was being opened
        self._attends: Attends | None = None

    def open(self, name: str, door: Door, onward: str, tell: Tell) -> OpenedDoor:
        """Open a door, before `begin`, whose streams go to `onward`, "unix/PATH" or "tcp/HOST:PORT".

        Raises OSError, with the address and a remedy, if it cannot listen.
        """
        if self._process is None:
            self._process = SideProcess("netem.gateways.tls_front_process")
        number = len(self._doors)
        line = line_of(OpenDoor(number, str(self._folder), name, door.listen, onward, door.admits, door.only_from,
                                door.most))
        while True:
            answer = self._process.ask(line)
            if not answer:
                raise OSError(f"{name}: cannot listen on {door.listen}: the process of the TLS doors did not start: "
                              "its error is above")
            line = b""
            match message := to_run.decode(answer):
                case Opened(port=port):
                    break
                case NotOpened(why=why):
                    raise OSError(f"{name}: cannot listen on {door.listen}: {why}; end the program or run that has it, "
                                  "or listen on another address or port")
                case _:
                    self._early.append(message)
        self._doors.append(OpenedDoor(text_of((address_of(door.listen)[0], port)), tell))
        return self._doors[-1]

    def begin(self, attends: Attends) -> None:
        """Tell who comes and is refused whenever `attends` lets time pass."""
        if self._process is not None:
            self._attends = attends
            attends.attend(self._process.socket, self.attend)

    def attend(self) -> None:
        """Tell what the front has said."""
        assert self._process is not None
        lines = self._process.receive()
        messages, self._early = [*self._early, *map(to_run.decode, lines or ())], []
        for message in messages:
            if isinstance(message, Came | Left | Refused):
                self._doors[message.number].note(message)
        if lines is None:
            for door in self._doors:
                door.end()
            self.leave()

    def leave(self) -> None:
        """Tell no more who comes; the doors stay open."""
        if self._attends is not None and self._process is not None:
            self._attends.leave(self._process.socket)
        self._attends = None

    def close(self) -> None:
        """Close all doors and the streams through them."""
        self.leave()
        if self._process is not None:
            self._process.close()
            self._process = None
