"""The recorders of a run: those of every run, those that its media request, and those of `[records]`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from experiments.scenario.model import Scenario
from netem.media.medium import Medium
from netem.records import Feed, Place, Recorder
from netem.records.table import IN_EVERY_RUN, RECORDERS


def with_needed(asked: Sequence[tuple[str, Any]]) -> list[tuple[str, Any]]:
    """Return the recorders with those that they need, each before the recorders that need it."""
    found: dict[str, Any] = {}
    settings_of = dict(asked)
    needed = [kind for each, _ in asked for kind in RECORDERS[each].NEEDS]
    for kind in needed:
        found[kind] = settings_of.get(kind) or RECORDERS[kind].Settings()
    return [*found.items(), *((kind, settings) for kind, settings in asked if kind not in found)]


class Recording:
    """`feed` has the subscriptions of `recorders`, which the runner finishes in this order."""

    def __init__(self, scenario: Scenario, place: Place) -> None:
        self.feed = Feed()
        asked: list[tuple[str, Any]] = [pair for name, medium in scenario.media.items()
                                        for pair in medium.settings.recorders(name).items()]
        asked += scenario.records.items()
        asked += [(kind, RECORDERS[kind].Settings()) for kind in IN_EVERY_RUN]
        asked = with_needed(asked)
        self.recorders: list[Recorder] = [RECORDERS[kind](settings, place) for kind, settings in asked]

    def begin(self, media: Mapping[str, Medium]) -> None:
        self.feed.frames = {name: medium.taps for name, medium in media.items()}
        for recorder in self.recorders:
            recorder.record(self.feed)

    def keep(self) -> None:
        for recorder in self.recorders:
            recorder.keep()
