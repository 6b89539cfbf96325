"""Real time: the same nodes and media with a wall clock, and gateways to devices and programs outside the run.

A member of the kind `Gateway` stands on a medium like a node, but its bytes come from and go to the outside, at the
wall clock's pace: it waits for what comes in and hands out what goes out. It is a class with a settings class, and a
line in the table (table.py); the run builds it as `Member(name, medium, settings, event=...)`, where `event` takes a
kind, a detail and a level.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol


class Gateway(Protocol):
    name: str
    medium: str

    def fileno(self) -> int:
        """Of what becomes readable when bytes come in."""

    def receive(self, most: int) -> list[bytes]:
        """At most `most` of the messages that have come in, oldest first; never blocks, never raises for bytes."""

    def send(self, data: bytes) -> None:
        """Hand `data` out; what cannot be sent now is lost, as on a line that nobody listens to."""

    def counters(self) -> Mapping[str, int]:
        """How many messages it has taken, refused, sent and not sent, under names for `run.json`."""

    def close(self) -> None: ...
