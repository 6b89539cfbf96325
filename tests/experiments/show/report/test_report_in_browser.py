"""The report in a real browser: charts are drawn, a click on what broke moves them, it fits narrow and dark screens."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import pytest

from experiments.show.report.build import write_report
from firmware_sim.height_chart import HeightChart
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.records.events import Event
from netem.records.ledger import Ledger
from netem.records.signals import SignalFile
from netem.wire.level import Level
from tests.browser import Browser, browser, needs_browser

pytestmark = [pytest.mark.slow, needs_browser]

MS = 1_000_000
BROKEN_S = 1.23
LENGTH_MS = 2_000
VIOLATION = {"on": "radio: a -> b", "node": "b", "from_ns": 1_230 * MS, "until_ns": 1_400 * MS, "worst": 3.0,
             "cause": "frames 121, 122 and 1 more lost (impairments[0] scripted_loss)"}
STANDING = {"name": "losses", "kind": "successive_losses", "on": "radio: a -> b",
            "requires": "at most 1 successive losses", "unit": "", "expected": "holds", "judged": True,
            "violations": 1, "first": VIOLATION, "violated_ns": 170 * MS, "worst": 3.0, "margin": -2.0}
SCENARIO = {"name": "small", "seed": 1, "length_ns": LENGTH_MS * MS, "question": "Does b hear a?",
            "question_signal": "*.x", "guarantees": {"losses": {"unit": ""}},
            "media": {"radio": {"kind": "broadcast_radio"}}, "expect": {"b.x.max": {"max": 1.0}}}


def small_run(folder: Path) -> Path:
    """Two bodies that drive; a speaks every 10 ms; a guarantee, an assumption and an expectation break at 1.23 s."""
    folder.mkdir(parents=True)
    ledger = Ledger(folder / "ledger.parquet", metadata={"seed": "1"})
    for number in range(LENGTH_MS // 10):
        start = number * 10 * MS
        lost = 121 <= number <= 123
        ledger.expect(1, "radio")
        ledger.close(Frame("radio", "a", number, start, b"xyz", on_air_ns=start, end_ns=start + MS), "b",
                     Fate.LOST if lost else Fate.DELIVERED, cause="impairments[0] scripted_loss" if lost else "",
                     delivered_ns=-1 if lost else start + 2 * MS)
    ledger.finish()
    recorder = SignalFile(folder / "signals.mcap")
    for node, side in (("a", 0.0), ("b", 1.0)):
        recorder.declare(node, [("x", "m"), ("y", "m"), ("theta", "rad")])
        for k in range(LENGTH_MS // 10):
            x = 1.5 if node == "b" and k == 123 else 0.4 * k / 100
            recorder.append(node, k * 10 * MS, (x, side, 0.0))
    recorder.event(Event(1_230 * MS, "b", "assumption violated", "age of information", Level.WARNING))
    recorder.event(Event(1_230 * MS, "b", "guarantee violated", "losses: " + str(VIOLATION["cause"]), Level.WARNING))
    (folder / "scenario.json").write_text(json.dumps(SCENARIO))
    (folder / "run.json").write_text(json.dumps({"reached_ns": LENGTH_MS * MS, "counters": {"b": {"heard": 197}}}))
    (folder / "summary.json").write_text(json.dumps({"host": "inline"}))
    (folder / "guarantees.json").write_text(json.dumps([{"standing": STANDING, "violations": [VIOLATION]}]))
    recorder.finish({}, json.dumps(SCENARIO).encode())
    return folder


@pytest.fixture(scope="module")
def screen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_report(small_run(tmp_path_factory.mktemp("small") / "run"))


@pytest.fixture
def show(screen: Browser, small: Path) -> Callable[..., Browser]:
    def open_it(width: int = 1400, *, dark: bool = False) -> Browser:
        screen.show(small, width, dark=dark)
        return screen
    return open_it


def ranges(page: Browser) -> dict[str, list[float]]:
    return {chart: page.run(f"document.getElementById('plot-{chart}').layout.xaxis.range.map(Number)")
            for chart in ("signal", "slots")}


def cursors(page: Browser) -> dict[str, list[float]]:
    """In seconds the lines that mark the chosen instant."""
    return {chart: [x / scale for x in page.run(
        f"document.getElementById('plot-{chart}').layout.shapes"
        ".filter((shape) => shape.line && shape.line.dash === 'dash').map((shape) => shape.x0)")]
        for chart, scale in (("signal", 1), ("slots", 1000))}


def test_every_chart_of_a_run_is_drawn(screen: Browser, whole_run: Path) -> None:
    screen.show(write_report(whole_run))

    assert screen.errors == []
    assert screen.run("document.querySelectorAll('.js-plotly-plot .cartesianlayer').length") == 6
    assert screen.run("document.getElementById('slot-note').textContent") == "79 frames in this window"


def test_heights_that_were_made_before_the_run_are_drawn(screen: Browser, tmp_path: Path) -> None:
    folder = small_run(tmp_path / "run")
    (folder / "charts.json").write_bytes(msgspec.json.encode([HeightChart(
        f"hill {k}", "a note", "x [m]", "y [m]", "m", [0.0, 1.0, 5.0], [0.0, 2.0], [[0.0, 1.0, 2.0], [3.0, 4.0, 7.0]])
        for k in range(2)]))

    screen.show(write_report(folder), width=420)

    assert screen.errors == []
    assert screen.run("document.querySelectorAll('#charts .heatmaplayer image').length") == 2
    assert screen.run("document.getElementById('plot-chart-1').layout.xaxis.range") == [0, 5]
    assert screen.run("document.documentElement.scrollWidth") <= 420


@pytest.mark.parametrize("kind", ["guarantee violated", "assumption violated", "expectation broken"])
def test_a_click_on_what_broke_leads_to_its_instant_in_all_three(show, kind: str) -> None:
    page = show()
    page.run(f"[...document.querySelectorAll('.moments > li')].find((item) => item.querySelector('.kind')"
             f".textContent === {kind!r}).querySelector('.at').id = 'wanted'")

    page.click("#wanted")

    assert page.errors == []
    assert cursors(page) == {"signal": [BROKEN_S], "slots": [pytest.approx(BROKEN_S)]}
    (signal_from, signal_until), (slots_from, slots_until) = ranges(page).values()
    assert signal_until - signal_from < LENGTH_MS / 1000 / 5
    assert signal_from < BROKEN_S < signal_until
    assert slots_from < BROKEN_S * 1000 < slots_until
    assert page.run("DATA.plane.instants_s[document.getElementById('plane-at').value]") == pytest.approx(BROKEN_S)
    assert page.run("document.getElementById('plane-time').textContent") == "1.23 s, a guarantee is violated"
    page.until("Math.abs(document.getElementById('plane').getBoundingClientRect().top) < 40")


def test_the_frames_of_a_cause_fold_out_and_lead_to_their_instants(show) -> None:
    page = show()

    page.click("details.frames summary")
    page.until("document.querySelectorAll('details.frames[open] li').length === 3")
    shown = page.run("[...document.querySelectorAll('details.frames[open] li')].map((item) => item.textContent)")
    page.click("details.frames[open] li button")

    assert shown == ["frame 121 at 1.21 s", "frame 122 at 1.22 s", "and 1 more"]
    assert cursors(page)["slots"] == [pytest.approx(1.21)]


def test_the_whole_run_comes_back_and_the_instant_can_be_closed(show) -> None:
    page = show()
    page.click(".moments .at")

    page.click("#signal-whole")
    page.click("#instant-close")

    assert ranges(page)["signal"] == [0, LENGTH_MS / 1000]
    assert cursors(page) == {"signal": [], "slots": []}


def test_the_signal_of_the_question_is_drawn_first(show) -> None:
    page = show()

    assert page.run("document.getElementById('signal').selectedOptions[0].textContent") == "x [m]"


def test_the_contents_stay_in_view_on_wide_screens_and_stand_on_top_of_narrow_ones(show) -> None:
    wide = show(1400)
    wide.run("window.scrollTo({top: 1500, behavior: 'instant'})")
    wide.settle()
    in_view = wide.run("(() => { const box = document.querySelector('#contents a').getBoundingClientRect();"
                       "return box.top >= 0 && box.bottom <= innerHeight; })()")
    narrow = show(420)

    assert in_view
    assert narrow.run("document.getElementById('contents').getBoundingClientRect().bottom"
                      " <= document.querySelector('h1').getBoundingClientRect().top")


@pytest.mark.parametrize("width", [420, 800, 1400])
def test_nothing_sticks_out_at_the_side(show, width: int) -> None:
    page = show(width)
    page.click(".moments .at")

    assert page.run("document.documentElement.scrollWidth") == width
    assert page.run("[...document.querySelectorAll('.plot .main-svg')].filter((chart) =>"
                    " chart.getBoundingClientRect().right"
                    " > chart.closest('section').getBoundingClientRect().right + 1).length") == 0
    assert page.run("document.querySelectorAll('.js-plotly-plot').length") == 7


def test_verdicts_are_read_on_a_narrow_screen_without_scrolling_aside(show) -> None:
    page = show(420)
    page.run("""(() => { const cells = document.querySelector('#expectations tbody tr, #expectations tr:has(td)').cells;
        const words = ["<code>guarantee.no_escape.first_violation_s</code>", "-40.25", "0.0252443", "120.5",
                       "✗ does not hold"];
        words.forEach((word, index) => { cells[index].innerHTML = word; });
        cells[4].className = "fails"; })()""")          # a long key and a long verdict

    assert page.run("[...document.querySelectorAll('#expectations .scroll')].filter((box) =>"
                    " box.scrollWidth > box.clientWidth).length") == 0


@pytest.mark.parametrize("width", [900, 1300])
def test_no_button_of_a_chart_lies_on_a_legend(show, width: int) -> None:
    page = show(width)
    page.until("document.querySelector('#plot-plane .legend .traces')")

    assert page.run("""[...document.querySelectorAll('.js-plotly-plot')].filter((chart) => {
        const legend = chart.querySelector('.legend')?.getBoundingClientRect();
        return legend && [...chart.querySelectorAll('.modebar-btn')].map((button) => button.getBoundingClientRect())
            .some((box) => box.right > legend.left && box.left < legend.right && box.bottom > legend.top
                           && box.top < legend.bottom);
    }).map((chart) => chart.id)""") == []


def test_the_caption_of_the_plane_explains_what_is_drawn_and_nothing_else(show) -> None:
    assert show().run("byId('plane-caption').textContent") == "Lines: paths so far."


def test_a_verdict_and_its_sign_stay_on_one_line_and_so_does_the_head_of_a_column(show) -> None:
    page = show(1000)

    assert page.run("""[...document.querySelectorAll('#guarantees th:nth-last-child(2), #guarantees td:last-child')]
        .map((cell) => {
            cell.style.width = cell.style.maxWidth = '1px';
            const words = document.createRange();
            words.selectNodeContents(cell);
            return words.getClientRects().length;
        })""") == [1, 1]


@pytest.mark.parametrize("dark", [False, True])
def test_the_words_of_the_charts_are_in_the_colours_of_the_page(show, dark: bool) -> None:
    page = show(dark=dark)

    ink = page.run("css('--ink')")
    assert ink == ("#e6e9ec" if dark else "#1b1f24")
    assert page.run("[...document.querySelectorAll('.js-plotly-plot')]"
                    ".map((chart) => chart.layout.font.color)") == [ink] * 7
    assert page.run("document.querySelector('#plot-fates').data.map((bar) => bar.marker.color)") == (
        ["#14c494", "#e69f00"] if dark else ["#008a63", "#b97d00"])


def test_reports_that_share_plotly_open_from_their_files(screen: Browser, tmp_path: Path) -> None:
    first, second = (small_run(tmp_path / "runs" / name) for name in ("one", "two"))
    write_report(first)

    screen.show(write_report(second))

    assert screen.errors == []
    assert screen.run("document.querySelectorAll('.js-plotly-plot .cartesianlayer').length") == 7


def test_a_page_whose_plotly_is_not_there_says_how_to_mend_it(screen: Browser, tmp_path: Path) -> None:
    alone = tmp_path / "elsewhere" / "report.html"
    alone.parent.mkdir()
    first, second = (small_run(tmp_path / "runs" / name) for name in ("one", "two"))
    write_report(first)
    alone.write_bytes(write_report(second).read_bytes())

    screen.show(alone)

    words = screen.run("document.querySelector('#signals .empty').textContent")
    assert "This chart cannot be drawn" in words
    assert "marconet report RUN_DIR --self-contained" in words
