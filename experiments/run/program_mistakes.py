"""Mistakes of programs that end nothing, as their boards tell them: events of level ERROR, a line for each kind."""

from __future__ import annotations

from netem.records.events import Event
from netem.wire.level import Level


class ProgramMistakes:
    def __init__(self) -> None:
        self._found: dict[tuple[str, str], tuple[Event, int]] = {}      # by node and kind: the first, how many

    def event(self, event: Event) -> None:
        if event.level == Level.ERROR:
            first, count = self._found.get((event.node, event.kind), (event, 0))
            self._found[event.node, event.kind] = first, count + 1

    def lines(self) -> list[str]:
        """Return a line for each node and kind, with the first of its events."""
        return [f"{event.node}: {event.kind} at {event.time_ns * 1e-9:.9g} s{f', {count} times' * (count > 1)}: "
                f"{event.detail}" for event, count in self._found.values()]
