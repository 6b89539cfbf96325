"""Which events the page lists: what is told at every step hides nothing else, and no warning is left out for it."""

from __future__ import annotations

from experiments.show.report.build import FEW_OF_A_KIND, MOST_EVENTS, MOST_OF_A_KIND, listed_events
from netem.records.events import Event
from netem.wire.level import Level


def told(kind: str, count: int, level: Level = Level.INFO, start_ns: int = 0) -> list[Event]:
    return [Event(start_ns + k, "robot", kind, str(k), level) for k in range(count)]


def test_of_what_is_told_at_every_step_a_few_are_listed_beside_all_the_rest() -> None:
    chatter, rest = told("gain product", 400), told("assumption violated", 2, Level.WARNING, start_ns=350)

    listed = listed_events(sorted(chatter + rest, key=lambda event: event.time_ns))

    assert [event.kind for event in listed] == ["gain product"] * FEW_OF_A_KIND + ["assumption violated"] * 2


def test_a_kind_of_which_there_are_not_too_many_is_listed_in_full() -> None:
    events = told("adopted topology", MOST_OF_A_KIND)

    assert listed_events(events) == events


def test_of_very_many_warnings_the_first_are_listed() -> None:
    events = told("CAN error frame", 1000, Level.WARNING)

    assert listed_events(events) == events[:MOST_OF_A_KIND]


def test_the_list_ends_somewhere() -> None:
    events = [event for kind in range(100) for event in told(str(kind), 20)]

    assert len(listed_events(events)) == MOST_EVENTS
