"""Media: what carries frames between ports. A medium lives in the emulator process.

A member of this kind takes offers in the order (time, node name, sequence number) and answers one question for the
conservative windows: when could anything handed out at or after `t0_ns` reach a node at the earliest?
It puts its own events on the agenda it was built with, hands received copies to `Links.receive`, and closes in the
ledger every copy that does not get that far.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol


class Shown(NamedTuple):
    """A table that `marconet check` prints."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


class MediumSettings:
    """Questions that the settings of every kind of medium answer, with defaults."""

    def shown(self, medium: str, nodes: Sequence[str]) -> list[Shown]:
        """Bounds and load of the medium of that name between `nodes`, known before the run."""
        return []


class Medium(Protocol):
    name: str

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        """`sender` hands out `data` at `now_ns`; called in order, never for a time before the last event run."""

    def lookahead_ns(self, t0_ns: int) -> int:
        """Earliest instant (>= t0_ns) at which anything handed out from t0_ns on, or on the air now, reaches a node."""

    def finish(self, end_ns: int) -> None:
        """The run ended: close every copy that is still queued or on the air as `Fate.UNFINISHED`."""
