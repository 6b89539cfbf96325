"""All that pages have been told of a run so far, for a page that is opened later."""

from __future__ import annotations

from typing import Any

import msgspec

from experiments.show.view.latest_events import LatestEvents
from experiments.show.view.messages import LinkCounts, Update


class Standing:
    def __init__(self) -> None:
        self.last: Update | None = None
        self._links: list[tuple[str, str, str]] = []
        self._counts: dict[int, LinkCounts] = {}
        self._at: dict[str, Any] = {}
        self._events = LatestEvents()

    def add(self, update: Update) -> None:
        self.last = update
        self._links.extend(update.links)
        self._counts.update((counts[0], counts) for counts in update.changed)
        self._at.update(update.at)
        for event in update.events:
            self._events.add(event)

    def whole(self) -> Update | None:
        """Return one update with all of them; None before the first."""
        if self.last is None:
            return None
        return msgspec.structs.replace(self.last, links=self._links, changed=list(self._counts.values()), at=self._at,
                                       events=self._events.all(), samples={})
