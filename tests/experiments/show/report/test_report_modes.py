"""Stays in modes, tables of events, and marks in the plane, from events alone."""

from __future__ import annotations

from typing import Any

import pytest

from agents.hybrid.mode_change import ModeChange
from experiments.judge.frame_copies import FrameCopies
from experiments.judge.run_data import RunData
from experiments.show.report.event_tables import event_tables, heading, told
from experiments.show.report.marks import instants_ns, marks
from experiments.show.report.modes import KILLED, RUN_ENDED, for_page, mode_names, stay_tables, stays
from netem.records.event_fields import written
from netem.records.events import Event

S = 1_000_000_000
END_NS = 10 * S


def changed(node: str, at_s: float, before: str, after: str, cause: str = "", by: str = "") -> Event:
    change = ModeChange(round(at_s * S), node, before, after, {"x": 1.0}, {"x": 1.0}, {}, by, cause)
    return Event(change.time_ns, node, "mode", change.detail())


def a_run(*events: Event, **more: Any) -> RunData:
    return RunData(END_NS, FrameCopies.of_rows([]), events=events, **more)


BIDS = written({"target": "t", "bid": 0.123456, "way_m": 2.5})
HUNT = (changed("a", 0, "", "idle", "start"), changed("a", 2, "idle", "hunting", BIDS, by="b"),
        changed("a", 3, "hunting", "hunting", "turns"), changed("a", 5, "hunting", "idle", "caught it", by="t"))


def test_a_stay_lasts_to_the_next_other_mode_or_to_the_end_of_the_run() -> None:
    found = stays(a_run(*HUNT))

    assert [(stay.mode, stay.from_ns, stay.until_ns, stay.end, stay.end_by, stay.started) for stay in found] == [
        ("idle", 0, 2 * S, BIDS, "b", True), ("hunting", 2 * S, 5 * S, "caught it", "t", False),
        ("idle", 5 * S, END_NS, RUN_ENDED, "", False)]


def test_a_stay_ends_with_the_death_of_its_node() -> None:
    events = (*HUNT[:2], changed("a", 7, "", "idle", "start"))

    found = stays(a_run(*events, run={"dead_ns": {"a": [[4 * S, 7 * S]]}}))

    assert [(stay.mode, stay.until_ns, stay.end) for stay in found] == [
        ("idle", 2 * S, BIDS), ("hunting", 4 * S, KILLED), ("idle", END_NS, RUN_ENDED)]


def test_an_event_that_tells_no_change_of_mode_is_left_out() -> None:
    assert stays(a_run(Event(0, "a", "mode", "flying"))) == []
    assert for_page(a_run(), []) is None


def test_modes_are_in_the_order_of_their_automata_that_of_the_most_robots_first() -> None:
    declared = {"t": ["in", "out"], "a": ["idle", "seen", "hunting"], "b": ["idle", "seen", "hunting"]}
    data = a_run(changed("t", 0, "", "out", "start"), changed("x", 0, "", "other", "start"), *HUNT,
                 scenario={"modes": declared})

    assert mode_names(data, stays(data)) == ["idle", "seen", "hunting", "in", "out", "other"]
    assert mode_names(a_run(*HUNT), stays(a_run(*HUNT))) == ["idle", "hunting"]


def test_the_table_has_the_stays_in_other_modes_than_the_first_with_the_values_of_their_causes() -> None:
    data = a_run(*HUNT, changed("t", 0, "", "in", "start"), changed("t", 5, "in", "out", "caught", by="a"))

    hunts, ends = stay_tables(data, stays(data))

    assert (hunts.initial, hunts.columns, hunts.reasons) == ("idle", ["target", "bid", "way [m]"], False)
    (row,) = hunts.rows
    assert (row.stay.node, row.stay.mode, row.fields, row.stay.by, row.stay.end) == (
        "a", "hunting", ["t", "0.1235", "2.5"], "b", "caught it")
    assert (ends.initial, ends.columns, ends.reasons) == ("in", [], True)
    assert [(row.stay.node, row.why) for row in ends.rows] == [("t", "caught")]


def seen(node: str, at_s: float, target: str, **more: float) -> Event:
    return Event(round(at_s * S), node, "detection", written({"target": target, **more}))


def test_events_with_named_values_are_tables_grouped_by_the_first_value() -> None:
    data = a_run(seen("a", 1, "t2", number=1), seen("b", 2, "t1", number=1), seen("a", 3, "t2", x_m=0.5),
                 Event(4 * S, "a", "note", "free text"),
                 Event(4 * S, "a", "half", "a=1"), Event(5 * S, "a", "half", "b"))

    (table,) = event_tables(told(data))

    assert (table.kind, table.columns, table.total) == ("detection", ["target", "number", "x [m]"], 3)
    assert [(row.time_ns // S, row.node, row.values) for row in table.rows] == [
        (2, "b", ["t1", "1", ""]), (1, "a", ["t2", "1", ""]), (3, "a", ["t2", "", "0.5"])]


@pytest.mark.parametrize(("name", "shown"), [
    ("way_m", "way [m]"), ("speed_mps", "speed [m/s]"), ("P_R", "P_R"), ("m", "m")])
def test_a_heading_tells_the_unit_of_a_value(name: str, shown: str) -> None:
    assert heading(name) == shown


def test_a_polygon_is_there_until_it_is_over_drawn_anew_or_the_run_ends() -> None:
    shape = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
    drawn = [Event(at_s * S, node, kind, written({"of": of} | ({} if kind.endswith("over") else {"corners_m": shape})))
             for at_s, node, kind, of in ((1, "a", "cone", "t1"), (2, "b", "cone", "t1"), (3, "a", "cone", "t2"),
                                          (4, "a", "cone over", "t1"), (6, "b", "cone", "t1"))]
    events = told(a_run(*drawn))

    found = marks(events, END_NS)

    assert [(polygon["node"], polygon["from_s"], polygon["until_s"]) for polygon in found["polygons"]] == [
        ("a", 1, 4), ("b", 2, 6), ("a", 3, 10), ("b", 6, 10)]
    assert (found["polygons"][0]["what"], found["polygons"][0]["x"], found["polygons"][0]["y"]) == (
        "cone", [0, 1, 0], [0, 0, 1])
    assert [polygon["until_s"] for polygon in marks(events, END_NS, {"a": [[3.5 * S, 5 * S]]})["polygons"]] == [
        3.5, 6, 3.5, 10]
    assert found["kinds"] == []
    assert [table.kind for table in event_tables(events)] == ["cone"]
    assert event_tables(events)[0].columns == ["of"]


def test_events_with_a_place_are_points_and_others_are_words() -> None:
    bid = Event(2 * S, "b", "bid", written({"bid": 0.98765, "for": "t"}))
    events = told(a_run(bid, seen("a", 3, "t", x_m=1.25, y_m=-2.0)))

    points, words = marks(events, END_NS)["kinds"]

    assert (points["kind"], points["node"], points["t_s"], points["x"], points["y"]) == (
        "detection", ["a"], [3.0], [1.25], [-2.0])
    assert points["text"] == ["detection of a at 3.000 s: target t"]
    assert (words["kind"], words["x"], words["words"]) == ("bid", [None], ["bid 0.988"])
    assert instants_ns(events, [5 * S]) == [2 * S, 3 * S, 5 * S]
