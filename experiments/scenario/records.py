"""Reads `[records.KIND]`: recorders besides those of every run and those that the settings of a medium request."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from experiments.scenario.problems import near
from experiments.scenario.sections import Reading
from experiments.scenario.shape import shape_of
from netem.records.table import ASKED_BY_MEDIA, IN_EVERY_RUN, RECORDERS


def on_request() -> list[str]:
    """Return the kinds of recorders that `[records]` may name."""
    return [kind for kind in RECORDERS if kind not in (*IN_EVERY_RUN, *ASKED_BY_MEDIA)]


def read_records(tables: Mapping[str, Any], reading: Reading) -> dict[str, Any]:
    """Return the settings of the requested recorders, by kind."""
    found = {}
    for kind, table in tables.items():
        if kind not in on_request():
            reading.problems.add(("records", kind), f"no such recorder; {near(kind, on_request())}")
            continue
        cls = RECORDERS[kind].Settings
        settings = reading.tables.read(shape_of(cls), table, ("records", kind), (), cls).made
        if settings is not None:
            found[kind] = settings
    return found
