"""The ledger: one row per frame copy, with its times and exactly one fate.

Conservation is counted at two places that do not know each other: `expect` where copies come into being (a medium for the
intended receivers of a frame, a link for duplicates) and `close` where they end.
"""

from __future__ import annotations

from collections import Counter

from netem.frames import Fate, Frame

Row = tuple[str, str, int, str, int, int, int, int, int, int, bytes, str, str]
COLUMNS = ("medium", "sender", "number", "receiver", "copy", "offered_ns", "on_air_ns", "end_ns", "delivered_ns",
           "size_bytes", "digest", "fate", "cause")


class Ledger:
    def __init__(self) -> None:
        self.expected = 0
        self.closed: Counter[Fate] = Counter()
        self._rows: list[Row] = []

    def expect(self, copies: int) -> None:
        self.expected += copies

    def close(self, frame: Frame, receiver: str, fate: Fate, *, copy: int = 0, delivered_ns: int = -1,
              cause: str = "") -> None:
        """End one copy. `delivered_ns` is when it reached the node (-1: it did not); `cause` names what ended it."""
        self.closed[fate] += 1
        self._rows.append((frame.medium, frame.sender, frame.number, receiver, copy, frame.offered_ns, frame.on_air_ns,
                           frame.end_ns, delivered_ns, len(frame.data), frame.digest, fate.value, cause))
