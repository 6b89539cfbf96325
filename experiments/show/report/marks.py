"""Events with named values in a view from above (`netem.records.event_fields`).

An event with a place is a point, one with corners a polygon while it lasts, any other words beside its robot.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from experiments.show.report.event_tables import Fields, heading, short
from experiments.show.report.facts import milliseconds
from netem.records import event_fields
from netem.records.events import Event

Json = dict[str, Any]
Told = Mapping[str, Sequence[tuple[Event, Fields]]]
Deaths = Mapping[str, Sequence[Sequence[int]]]
MOST_OF_A_KIND = 2_000
MOST_INSTANTS = 600


def marks(told: Told, end_ns: int, dead_ns: Deaths = MappingProxyType({})) -> Json:
    """Return the points and words of each kind of event, and all polygons, with their instants [s].

    `dead_ns` are the intervals [start, end) in which a fault had killed a node, whose polygons end with it.
    """
    found: list[Json] = []
    for kind, events in told.items():
        if any(event_fields.CORNERS in fields for _, fields in events) or _ends_polygons(kind, told):
            continue
        shown = events[:MOST_OF_A_KIND]
        places = [event_fields.place(fields) for _, fields in shown]
        found.append({"kind": kind, "node": [event.node for event, _ in shown],
                      "t_s": [event.time_ns / 1e9 for event, _ in shown],
                      "x": [at[0] if at else None for at in places], "y": [at[1] if at else None for at in places],
                      "words": [f"{kind} {short(fields[kind], 3)}" if kind in fields else kind for _, fields in shown],
                      "text": [_text(event, fields) for event, fields in shown]})
    found.sort(key=lambda kind: all(x is None for x in kind["x"]))      # those with places first
    return {"kinds": found, "polygons": list(_polygons(told, end_ns, dead_ns))}


def instants_ns(told: Told, also_ns: Sequence[int] = ()) -> list[int]:
    """Return the first `MOST_INSTANTS` instants of events with named values, and of `also_ns`."""
    return sorted({*(event.time_ns for events in told.values() for event, _ in events), *also_ns})[:MOST_INSTANTS]


def _polygons(told: Told, end_ns: int, dead_ns: Deaths) -> Iterator[Json]:
    for kind, events in told.items():
        if _ends_polygons(kind, told):
            continue
        drawn = sorted([*((event, fields) for event, fields in events if event_fields.CORNERS in fields),
                        *told.get(kind + event_fields.OVER, ())], key=lambda item: item[0].time_ns)
        for place, (event, fields) in enumerate(drawn[:MOST_OF_A_KIND]):
            corners = event_fields.corners(fields)
            if not corners:
                continue
            until_ns = next((later.time_ns for later, others in drawn[place + 1:]
                             if (later.node, _first(others)) == (event.node, _first(fields))), end_ns)
            until_ns = min([until_ns, *(at_ns for at_ns, _ in dead_ns.get(event.node, ()) if at_ns >= event.time_ns)])
            yield {"what": kind, "node": event.node, "from_s": event.time_ns / 1e9, "until_s": until_ns / 1e9,
                   "x": [x for x, _ in corners], "y": [y for _, y in corners], "text": _text(event, fields)}


def _ends_polygons(kind: str, told: Told) -> bool:
    return kind.endswith(event_fields.OVER) and kind.removesuffix(event_fields.OVER) in told


def _first(fields: Fields) -> str:
    return next((value for name, value in fields.items() if name != event_fields.CORNERS), "")


def _text(event: Event, fields: Fields) -> str:
    hidden = (event_fields.CORNERS, event_fields.X, event_fields.Y)
    values = ", ".join(f"{heading(name)} {short(value)}" for name, value in fields.items() if name not in hidden)
    return f"{event.kind} of {event.node} at {milliseconds(event.time_ns)}" + (f": {values}" if values else "")
