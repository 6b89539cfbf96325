"""Counts what a live view shows: copies by link and fate, where nodes are, the latest events.

It adds to the run two calls of the C library for a chunk of copies and one assignment for a sample; all else is done
once for each update. What it holds does not grow with the length of the run.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from operator import itemgetter
from typing import Any, Final

from experiments.scenario.model import Scenario
from experiments.show.positions import places
from experiments.show.view.latest_events import LatestEvents
from experiments.show.view.messages import LinkCounts, TimedEvent
from netem.core.fate import Fate
from netem.records import Feed
from netem.records.events import Event
from netem.records.ledger import COLUMNS

LINK_AND_FATE: Final = itemgetter(*map(COLUMNS.index, ("medium", "sender", "receiver", "fate")))
OFFERED_NS: Final = COLUMNS.index("offered_ns")
ARRIVED: Final = frozenset(fate.value for fate in Fate if fate.arrived)
MOST_LINKS: Final = 2000            # in one update; others that have changed follow in the next

Link = tuple[str, str, str]


class Tally:
    """Subscribes to `feed`, before the first grant."""

    def __init__(self, scenario: Scenario, feed: Feed) -> None:
        self.events_total = 0
        self._poses = {node: pose.outputs for medium in scenario.media.values()
                       for node, pose in medium.settings.poses().items()}
        self._columns: dict[str, tuple[int, ...]] = {}
        self._names: dict[str, tuple[str, ...]] = {}
        self._latest: dict[str, Sequence[float]] = {}
        self._shown: dict[str, list[float | None]] = {}
        self._fresh: Counter[tuple[str, str, str, str]] = Counter()
        self._last: dict[tuple[str, str, str, str], Any] = {}
        self._place: dict[Link, int] = {}
        self._counts: list[LinkCounts] = []
        self._told_links = 0
        self._changed: dict[int, None] = {}
        self._events = LatestEvents()
        feed.copies.append(self._add_copies)
        feed.declared.append(self._declare)
        feed.samples.append(self._add_sample)
        feed.events.append(self._add_event)

    def _add_copies(self, rows: Sequence[Any]) -> None:
        keys = list(map(LINK_AND_FATE, rows))
        self._fresh.update(keys)
        self._last.update(zip(keys, rows, strict=True))

    def _add_sample(self, node: str, time_ns: int, values: Sequence[float]) -> None:
        self._latest[node] = values

    def _add_event(self, event: Event) -> None:
        self.events_total += 1
        self._events.add((event.time_ns, event.node, event.kind, event.detail, int(event.level)))

    def _declare(self, node: str, signals: Sequence[tuple[str, str]]) -> None:
        names = [name for name, _ in signals]
        self._names[node] = tuple(names)
        pose = self._poses.get(node, ())
        columns = next((columns for what, columns in places(names, [unit for _, unit in signals]) if not what), None)
        if columns is None and len(pose) > 1 and {*pose[:2]} <= {*names}:
            columns = pose[:2]
        if columns is not None:
            self._columns[node] = tuple(map(names.index, columns))

    def links(self) -> tuple[list[Link], list[LinkCounts]]:
        """Return the links that are new, and the counts of those that have changed since the last call."""
        for (medium, sender, receiver, fate), copies in self._fresh.items():
            link = (medium, sender, receiver)
            place = self._place.setdefault(link, len(self._counts))
            if place == len(self._counts):
                self._counts.append((place, -1, {}))
            _, newest_ns, by_fate = self._counts[place]
            by_fate[fate] = by_fate.get(fate, 0) + copies
            if fate in ARRIVED:
                newest_ns = max(newest_ns, self._last[medium, sender, receiver, fate][OFFERED_NS])
            self._counts[place] = (place, newest_ns, by_fate)
            self._changed[place] = None
        self._fresh.clear()
        self._last.clear()
        new = list(self._place)[self._told_links:]
        self._told_links = len(self._place)
        told = list(self._changed)[:MOST_LINKS]
        for place in told:
            del self._changed[place]
        return new, [self._counts[place] for place in told]

    def positions(self) -> dict[str, list[float | None]]:
        """Return x, y [m] and heading [rad] or None of each node that has moved since the last call."""
        moved = {}
        for node, columns in self._columns.items():
            if (values := self._latest.get(node)) is not None:
                at: list[float | None] = [values[column] for column in columns]
                at += [None] * (3 - len(at))
                if self._shown.get(node) != at:
                    self._shown[node] = moved[node] = at
        return moved

    def samples(self) -> Mapping[str, Mapping[str, float | None]]:
        """Return the latest value of each signal, by node."""
        return {node: dict(zip(self._names[node], values, strict=False)) for node, values in self._latest.items()
                if node in self._names}

    def events(self) -> list[TimedEvent]:
        """Return the latest events of each kind since the last call."""
        return self._events.take()
