"""The report of a Marco Polo game in a real browser: ground, fields of view, modes, C-targets, captures, tables."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from math import hypot
from pathlib import Path
from typing import Any

import pytest

from agents.hybrid.mode_change import ModeChange, read
from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario import find, load
from experiments.show.report.build import write_report
from netem.records import event_fields
from tests.browser import Browser, browser, needs_browser

pytestmark = [pytest.mark.slow, needs_browser]

AREA = 10.0
OBSTACLE = [[3.25, 5.5], [4.25, 5.5], [4.25, 6.5], [3.25, 6.5]]
ZONE = [[7.5, 4.25], [8.5, 4.25], [8.5, 5.25]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("game") / "run"
    scenario = load(find("marco_polo"), values={"team.obstacles": [OBSTACLE], "team.zones": [ZONE]})
    run(scenario, host="inline", out=out, report=False)
    return out


@pytest.fixture(scope="module")
def data(folder: Path) -> RunData:
    return load_run(folder)


@pytest.fixture(scope="module")
def page(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("profile")) as opened:
        opened.show(write_report(folder))
        yield opened
        assert opened.errors == []          # of the network as well


def at(page: Browser, t_s: float) -> None:
    """Move the animation to the first instant that is not before `t_s`."""
    page.run(f"(() => {{ byId('plane-at').value = firstFrom(DATA.plane.instants_s, {t_s} - 1e-9); drawPlane(); }})()")
    page.settle()


def traces(page: Browser, chart: str = "plane") -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(page.run(f"JSON.stringify(byId('plot-{chart}').data)"))
    return found


def named(page: Browser, name: str) -> dict[str, Any]:
    """Return the first trace with a name that has a point."""
    return next(trace for trace in traces(page) if trace.get("name") == name and trace["x"] != [None])


def robots(page: Browser) -> dict[str, tuple[str, str, float, float]]:
    """Return mode, colour and place of each robot of the picture."""
    trace = next(trace for trace in traces(page) if trace.get("uid") == "robots")
    return {text.partition(": ")[0]: (text.partition(": ")[2], colour, x, y) for text, colour, x, y in zip(
        trace["text"], trace["marker"]["color"], trace["x"], trace["y"], strict=True) if x is not None}


def changes(data: RunData, start: str) -> list[ModeChange]:
    found = [read(event.time_ns, event.node, event.detail) for event in data.events
             if event.kind == "mode" and event.detail.startswith(start)]
    return [change for change in found if change is not None]


def fields(data: RunData, kind: str) -> list[tuple[float, str, dict[str, str]]]:
    return [(event.time_ns / 1e9, event.node, event_fields.read(event.detail) or {}) for event in data.events
            if event.kind == kind]


def test_the_picture_is_the_declared_area_with_its_obstacles_and_zones(page: Browser) -> None:
    at(page, 0.0)

    obstacle, zone = named(page, "obstacle"), named(page, "zone of poor communication")
    assert [tuple(corner) for corner in OBSTACLE] == list(zip(obstacle["x"], obstacle["y"], strict=True))[:4]
    assert [tuple(corner) for corner in ZONE] == list(zip(zone["x"], zone["y"], strict=True))[:3]
    assert "fillpattern" in zone
    assert "fillpattern" not in obstacle
    for axis in ("xaxis", "yaxis"):
        low, high = page.run(f"byId('plot-plane').layout.{axis}.range")
        assert -0.1 * AREA < low < 0 < AREA < high < 1.1 * AREA
    assert [word.partition(" [")[2] for word in page.run(
        "['xaxis', 'yaxis'].map((axis) => byId('plot-plane').layout[axis].title.text)")] == ["m]", "m]"]


def test_parked_targets_are_not_in_the_picture_and_leave_no_path(page: Browser, data: RunData) -> None:
    at(page, 0.0)
    before = robots(page)
    at(page, 60.0)

    assert sorted(before) == sorted(data.scenario["team"]["sensors"])
    for trace in traces(page):
        if (trace.get("uid") or "").startswith("way"):
            for x, y, x2, y2 in zip(trace["x"], trace["y"], trace["x"][1:], trace["y"][1:], strict=False):
                if None not in (x, y, x2, y2):
                    assert hypot(x2 - x, y2 - y) < 0.5          # 2 m/s for 0.1 s, and the way to a change of mode


def test_robots_have_the_colour_of_their_mode_and_fields_of_view_its_dash(page: Browser, data: RunData) -> None:
    pursuit = changes(data, "waiting -> pursuing")[0]
    at(page, pursuit.time_ns / 1e9)

    shown = robots(page)
    colours = dict(page.run("DATA.modes.names.map((name, k) => [name, modeColour(k)])"))
    assert shown[pursuit.node][:2] == ("pursuing", colours["pursuing"])
    last = {change.node: change.after for change in changes(data, "") if change.time_ns <= pursuit.time_ns}
    assert {node: mode for node, (mode, *_) in shown.items()} == {node: last[node] for node in shown}
    assert {mode: colour for mode, colour, *_ in shown.values()} == {
        mode: colours[mode] for mode, *_ in shown.values()}
    view, = (trace for trace in traces(page) if (trace.get("uid") or "").startswith("view")
             and trace["line"]["color"] == colours["pursuing"] and trace["x"] != [None])
    others = {trace["line"]["dash"] for trace in traces(page) if (trace.get("uid") or "").startswith("view")
              and trace["line"]["color"] != colours["pursuing"] and trace["x"] != [None]}
    assert view["line"]["dash"] not in others
    radius_m = data.scenario["team"]["radius_m"][pursuit.node]
    _, _, x_m, y_m = shown[pursuit.node]
    assert {round(hypot(x - x_m, y - y_m), 6) for x, y in zip(view["x"], view["y"], strict=True)
            if x is not None} == {radius_m}


def test_a_c_target_is_there_from_the_begin_to_the_end_of_the_investigation(page: Browser, data: RunData) -> None:
    begin_s, node, drawn = fields(data, "C-target")[0]
    end_s = next(at_s for at_s, other, _ in fields(data, "C-target over") if other == node)
    shown = {}
    for at_s in (begin_s - 0.2, begin_s, end_s - 0.2, end_s + 0.2):
        at(page, at_s)
        there = page.run("DATA.plane.instants_s[byId('plane-at').value]")
        shown[at_s] = [trace for trace in traces(page) if trace.get("uid", "").startswith("polygon")
                       and drawn["target"] in trace["text"] and trace["x"] != [None]]
        assert bool(shown[at_s]) == (begin_s <= there < end_s)

    corners = set(event_fields.corners(drawn))
    assert corners <= set(zip(shown[begin_s][0]["x"], shown[begin_s][0]["y"], strict=True))
    assert {len(found) for found in shown.values()} == {0, 1}


def test_detections_and_captures_stay_where_they_were_from_their_instants_on(page: Browser, data: RunData) -> None:
    for kind in ("detection", "capture"):
        told = fields(data, kind)
        at(page, told[0][0])
        some = named(page, kind)
        at(page, 60.0)
        every = named(page, kind)

        places = [(float(values["x_m"]), float(values["y_m"])) for _, _, values in told]
        assert list(zip(some["x"], some["y"], strict=True)) == places[:1]
        assert list(zip(every["x"], every["y"], strict=True)) == places
        assert min(places) > (0.0, 0.0)
        assert max(map(max, places)) < AREA


def test_bids_are_words_at_their_bidders_at_their_instant(page: Browser, data: RunData) -> None:
    bids = fields(data, "bid")
    first_s = bids[0][0]
    at(page, first_s)

    words = next(trace for trace in traces(page) if trace.get("uid") == "words")
    shown = robots(page)
    bidders = {(f"bid {float(values['bid']):.3g}", *shown[node][2:]) for at_s, node, values in bids if at_s == first_s}
    others = {("window open", *shown[node][2:]) for at_s, node, _ in fields(data, "window open")
              if first_s - 1 < at_s <= first_s}
    assert {(line, x, y) for text, x, y in zip(words["text"], words["x"], words["y"], strict=True)
            for line in text.split("<br>")} == bidders | others
    assert len(bidders) > 1
    assert others
    told = page.run("[...document.querySelectorAll('#plane-told li')].map((item) => item.textContent)")
    assert len([line for line in told if line.startswith("bid of")]) == len(bidders)


def test_the_modes_over_time_are_those_of_the_records(page: Browser, data: RunData) -> None:
    drawn = {(trace["name"], node, round(base, 6)) for trace in traces(page, "modes") if trace["type"] == "bar"
             for node, base in zip(trace["y"], trace["base"], strict=True)}
    patterns = Counter((trace["marker"]["color"], trace["marker"]["pattern"]["shape"])
                       for trace in traces(page, "modes") if trace["type"] == "bar")

    assert drawn == {(change.after, change.node, round(change.time_ns / 1e9, 6)) for change in changes(data, "")
                     if change.before != change.after}
    assert max(patterns.values()) == 1
    assert page.run("byId('plot-modes').layout.xaxis.title.text") == "time [s]"


def rows(page: Browser, table: str) -> list[list[str]]:
    found: list[list[str]] = page.run(f"[...document.querySelectorAll({json.dumps(table + ' tbody tr')})]"
                                      ".map((row) => [...row.cells].map((cell) => cell.textContent))")
    return found


def test_the_table_of_detections_has_those_of_each_target_together(page: Browser, data: RunData) -> None:
    shown = rows(page, "table[data-kind='detection']")
    told = sorted(fields(data, "detection"), key=lambda row: (row[2]["target"], row[0]))

    assert shown == [[values["target"], f"{at_s:.3f} s", node, values["number"], f"{float(values['x_m']):.4g}",
                      f"{float(values['y_m']):.4g}"]
                     for at_s, node, values in told]
    assert Counter(row[0] for row in shown) == {
        target: sum(counters.get(f"detections of {target}", 0) for counters in data.counters.values())
        for target in data.scenario["team"]["targets"]}


def test_the_table_of_deployments_says_who_why_and_with_what_end(page: Browser, data: RunData) -> None:
    deployed = changes(data, "waiting -> ")
    ends = {change.node: change for change in changes(data, "pursuing -> waiting")}
    shown = rows(page, "table[data-initial='waiting']")
    head = page.run("[...document.querySelector(\"table[data-initial='waiting'] tr\").cells]"
                    ".map((cell) => cell.textContent)")

    assert head == ["Robot", "Mode", "From", "Until", "target", "P_R", "gain", "way [m]", "bid", "Caused by", "End"]
    assert [row[:3] for row in shown] == [
        [change.node, change.after, f"{change.time_ns / 1e9:.3f} s"] for change in deployed]
    for row, change in zip(shown, deployed, strict=True):
        why = event_fields.read(change.cause)
        assert why is not None
        assert row[4] == why["target"]
        assert row[5:9] == [f"{float(why[name]):.4g}" for name in ("P_R", "gain", "way_m", "bid")]
        assert row[9] == change.by
    pursued = next(row for row in shown if row[1] == "pursuing" and row[0] in ends)
    assert pursued[-1].startswith(ends[pursued[0]].cause)


def test_a_click_in_a_table_moves_the_animation_and_the_modes_over_time(page: Browser, data: RunData) -> None:
    _, capture_s = min((values["target"], at_s) for at_s, _, values in fields(data, "capture"))

    page.click("table[data-kind='capture'] button.at")

    assert page.run("DATA.plane.instants_s[byId('plane-at').value]") == pytest.approx(capture_s)
    assert page.run("byId('plot-modes').layout.shapes.filter((shape) => shape.line.dash === 'dash')"
                    ".map((shape) => shape.x0)") == [pytest.approx(capture_s)]


def test_the_keyboard_steps_through_instants_and_events(page: Browser, data: RunData) -> None:
    at(page, 0.0)
    page.run("byId('plane-after').focus()")
    page.press("Enter")
    first = page.run("DATA.plane.instants_s[byId('plane-at').value]")
    page.run("byId('plane-at').focus()")
    page.press("ArrowRight")

    later = sorted({event.time_ns / 1e9 for event in data.events if event.time_ns and event.kind in (
        "mode", "detection", "window open", "bid", "deployed", "let go", "capture")
        and "inside -> inside" not in event.detail})
    assert first == pytest.approx(later[0])
    assert page.run("byId('plane-time').textContent.split(' ')[0]") == page.run(
        "String(+DATA.plane.instants_s[byId('plane-at').value].toFixed(3))")
    assert page.run("DATA.plane.instants_s[byId('plane-at').value]") > first


@pytest.mark.parametrize("width", [420, 1400])
def test_nothing_sticks_out_at_the_side(folder: Path, page: Browser, width: int) -> None:
    page.show(folder / "report.html", width, dark=width == 420)

    assert page.run("document.documentElement.scrollWidth") == width
    assert page.run("[...document.querySelectorAll('.plot .main-svg')].filter((chart) =>"
                    " chart.getBoundingClientRect().right"
                    " > chart.closest('section').getBoundingClientRect().right + 1).length") == 0
