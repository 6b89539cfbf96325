"""Starts the server of a view as a process of its own, and exchanges messages with it without ever waiting.

No update is made while the server has not taken the last one, so the buffer holds one update at most.
"""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.show.view.messages import (
    Answer,
    End,
    Listening,
    Refused,
    Scene,
    Start,
    ToRun,
    Update,
    line_of,
    to_run,
)
from netem.gateways.network_settings import NetworkSettings
from netem.wire.side_process import ENDS_WITHIN_S, SideProcess

if TYPE_CHECKING:
    from experiments.run.live.view_door import ViewDoor


class NoView(ValueError):
    """The view that was asked for cannot be had; the text says why and what to do."""

    exit_code = 2


class ServerProcess:
    """`url` is the address of the page with its token; `foxglove_url` that for Foxglove, "" if it was not asked for.

    `door` is the TLS door before the page, None if `network` has no certificates.
    """

    def __init__(self, port: int, foxglove: int | None, network: NetworkSettings = NetworkSettings()) -> None:
        self.door = None if network.tls is None else _door(network, port)
        token = secrets.token_urlsafe(24)
        start = Start(token, port, foxglove)
        if self.door is not None:
            start = Start(token, 0, foxglove, self.door.behind, self.door.hosts)
        self._side_process = SideProcess("experiments.show.view.server")
        self.socket = self._side_process.socket
        try:
            ready = self._begin(start)
        except BaseException:
            self.close(0.0)
            raise
        address = f"http://127.0.0.1:{ready.port}" if self.door is None else f"https://{self.door.hosts[0]}"
        self.url = f"{address}/?token={token}"
        self.with_foxglove = ready.foxglove is not None
        self.foxglove_url = f"ws://127.0.0.1:{ready.foxglove}" if self.with_foxglove else ""

    def _begin(self, start: Start) -> Listening:
        line = self._side_process.ask(line_of(start))
        if not line:
            raise NoView("--view: the server of the page did not start: its error is above")
        ready = to_run.decode(line)
        if isinstance(ready, Refused):
            raise NoView(ready.why)
        assert isinstance(ready, Listening)
        return ready

    @property
    def takes_more(self) -> bool:
        """Whether all that was sent has been taken."""
        return self._side_process.takes_more

    def send(self, message: Scene | Update | Answer | End) -> None:
        self._side_process.send(line_of(message))

    def receive(self) -> list[ToRun] | None:
        """Return the messages that have arrived; None if the server has ended."""
        lines = self._side_process.receive()
        return None if lines is None else [to_run.decode(line) for line in lines]

    def end(self, holds: bool, problems: Sequence[str], folder: Path, report: Path | None) -> None:
        """Tell the pages that the run has come to its end, what does not hold, and where its report is."""
        self.send(End("everything is as expected" if holds else "not everything is as expected", holds, problems,
                      str(folder), "" if report is None else str(report.absolute())))

    def fail(self, why: str) -> None:
        """Tell the pages what ended the run."""
        self.send(End(why, False, [], ""))

    def close(self, within_s: float = ENDS_WITHIN_S) -> None:
        """Let the server pass on what it has, then end it."""
        self._side_process.close(within_s)
        if self.door is not None:
            self.door.close()


def _door(network: NetworkSettings, port: int) -> ViewDoor:
    from experiments.run.live.view_door import ViewDoor  # late: few runs have a door

    return ViewDoor(network, port)
