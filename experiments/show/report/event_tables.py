"""A table for each kind of event whose details are named values (`netem.records.event_fields`).

Rows are grouped by the first value, such as the target of a detection, and within a group in the order of time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from experiments.judge.run_data import RunData
from netem.records import event_fields
from netem.records.events import Event

MOST_ROWS = 300
UNITS: Final = {"m": "m", "s": "s", "mps": "m/s", "rad": "rad", "deg": "deg", "hz": "Hz", "v": "V", "db": "dB"}
Fields = Mapping[str, str]


class EventRow(NamedTuple):
    time_ns: int
    node: str
    values: Sequence[str]


class EventTable(NamedTuple):
    kind: str
    columns: Sequence[str]
    rows: Sequence[EventRow]
    total: int


def told(data: RunData) -> dict[str, list[tuple[Event, Fields]]]:
    """Return the events with named values by kind, kinds in the order of their first events.

    A kind of which any event has another detail is left out.
    """
    found: dict[str, list[tuple[Event, Fields]]] = {}
    others: set[str] = set()
    for event in data.events:
        fields = event_fields.read(event.detail)
        if fields is None:
            others.add(event.kind)
        elif event.node:
            found.setdefault(event.kind, []).append((event, fields))
    return {kind: events for kind, events in found.items() if kind not in others}


def event_tables(found: Mapping[str, Sequence[tuple[Event, Fields]]]) -> list[EventTable]:
    """Return the tables of kinds; that of the end of a polygon has none."""
    return [_table(kind, events) for kind, events in found.items()
            if kind.removesuffix(event_fields.OVER) not in found.keys() - {kind}]


def _table(kind: str, events: Sequence[tuple[Event, Fields]]) -> EventTable:
    names = [name for name in dict.fromkeys(name for _, fields in events for name in fields)
             if name != event_fields.CORNERS]
    shown = sorted(events[:MOST_ROWS], key=lambda item: (item[1].get(names[0], "") if names else "", item[0].time_ns))
    return EventTable(kind, [heading(name) for name in names],
                      [EventRow(event.time_ns, event.node, [short(fields.get(name, "")) for name in names])
                       for event, fields in shown], len(events))


def heading(name: str) -> str:
    """Return the name of a value as the heading of a column: "way_m" as "way [m]"."""
    words, _, unit = name.rpartition("_")
    return f"{words} [{UNITS[unit]}]" if words and unit in UNITS else name


def short(value: str, digits: int = 4) -> str:
    """Return a number with this many significant digits, other text as it is."""
    try:
        return f"{float(value):.{digits}g}"
    except ValueError:
        return value
