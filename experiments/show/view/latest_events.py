"""The latest events of each kind, so that a frequent kind does not push a rare one out."""

from __future__ import annotations

from collections import deque
from typing import Final

from experiments.show.view.messages import TimedEvent

MOST_OF_A_KIND: Final = 30
MOST_KINDS: Final = 40              # others share one place


class LatestEvents:
    def __init__(self) -> None:
        self._of: dict[str, deque[tuple[int, TimedEvent]]] = {}
        self._so_far = 0

    def add(self, event: TimedEvent) -> None:
        kind = event[2] if event[2] in self._of or len(self._of) < MOST_KINDS else ""
        if kind not in self._of:
            self._of[kind] = deque(maxlen=MOST_OF_A_KIND)
        self._of[kind].append((self._so_far, event))
        self._so_far += 1

    def all(self) -> list[TimedEvent]:
        """Return them in the order in which they came."""
        return [event for _, event in sorted(numbered for latest in self._of.values() for numbered in latest)]

    def take(self) -> list[TimedEvent]:
        """Return and forget them."""
        found = self.all()
        self._of.clear()
        return found
