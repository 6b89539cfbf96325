"""Reads `record = "frames"` and `[records.KIND]`: recorders besides those of every run and those that media request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from experiments.scenario.model import MediumSpec
from experiments.scenario.problems import near
from experiments.scenario.sections import Reading
from experiments.scenario.shape import shape_of
from netem.records.table import ASKED_BY_MEDIA, IN_EVERY_RUN, RECORDERS


def on_request() -> list[str]:
    """Return the kinds of recorders that `record` and `[records]` may name."""
    return [kind for kind in RECORDERS if kind not in (*IN_EVERY_RUN, *ASKED_BY_MEDIA)]


def read_records(named: str | Sequence[str], tables: Mapping[str, Any], media: Mapping[str, MediumSpec | None],
                 reading: Reading) -> dict[str, Any]:
    """Return the settings of the requested recorders, by kind: those `named`, and those with a table of their own."""
    found = {}
    words = [named] if isinstance(named, str) else named
    wanted: dict[str, tuple[tuple[str, ...], Any]] = {kind: (("record",), {}) for kind in words}
    wanted |= {kind: (("records", kind), table) for kind, table in tables.items()}
    settings_of = {name: medium.settings for name, medium in media.items() if medium is not None}
    for kind, (place, table) in wanted.items():
        if kind not in on_request():
            value = {} if place[0] == "records" else {"value": kind}
            reading.problems.add(place, f"no such recorder; {near(kind, on_request())}", **value)
            continue
        recorder = RECORDERS[kind]
        settings = reading.tables.read(shape_of(recorder.Settings), table, place, (), recorder.Settings).made
        if settings is not None:
            found[kind] = settings
            if len(settings_of) == len(media):
                for line in recorder.check(settings, settings_of):
                    reading.problems.add((*place, kind) if place == ("record",) else place, line)
    return found
