"""Gateways: runs in real time, in which devices and programs outside the run take part in a medium.

A member of the kind `Gateway` is on a medium like a node; it sends on the medium the bytes that it receives from
outside, and sends outside the frames that reach it, at the pace of the wall clock. It is a class with a settings class,
and a line in the table (table.py). The run builds it as `Member(name, medium, settings, event=...)`, where `event`
takes a kind, a detail and a level.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol


class Gateway(Protocol):
    name: str
    medium: str

    def fileno(self) -> int:
        """Return the descriptor that becomes readable when bytes arrive."""

    def receive(self, most: int) -> list[bytes]:
        """Return at most `most` of the messages that have arrived, oldest first; never block, never raise for bytes."""

    def send(self, data: bytes) -> None:
        """Send `data` outside; drop and count it if it cannot be sent now."""

    def counters(self) -> Mapping[str, int]:
        """Return the numbers of messages received, refused, sent and not sent, under names for `run.json`."""

    def close(self) -> None: ...
