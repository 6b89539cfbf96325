"""The page is read as a browser would read its parts; what it says is compared with the run folder it was made from."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from experiments.report.build import write_report
from netem.fate import Fate
from netem.frame import Frame
from netem.records.ledger import Ledger
from netem.records.ledger_table import read_metadata
from netem.records.signals import SignalRecorder

MakeRun = Callable[[Path, float], Path]
BROWSER = shutil.which("chromium") or shutil.which("google-chrome")


class Page(HTMLParser):
    """Text outside scripts and styles, the JSON element, and every address that a tag would fetch."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.fetched: list[str] = []
        self.scripts = 0
        self.json = ""
        self._in_json = False
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.open.append(tag)
        self.scripts += tag == "script"
        self._in_json = dict(attrs).get("id") == "data"
        self.fetched += [value for name, value in attrs if name in ("src", "href") and value and value != "data:,"]

    def handle_endtag(self, tag: str) -> None:
        if tag in self.open:
            while self.open.pop() != tag:
                pass

    def handle_data(self, data: str) -> None:
        if "script" in self.open and self._in_json:
            self.json += data
        elif "script" not in self.open and "style" not in self.open:
            self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words))

    @property
    def data(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self.json)
        return found


@pytest.fixture(scope="module")
def page(whole_run: Path) -> Page:
    return Page(write_report(whole_run))


def test_the_page_says_what_was_asked_what_came_out_and_which_run_it_is(page: Page, whole_run: Path) -> None:
    assert "Do five robots still agree" in page.text
    assert "1 of 4 expectations do not hold" in page.text
    assert re.search(r"radio.delivery_ratio = 0\.93\d+: 0\.0\d+ below the least allowed, 0.95", page.text)
    ledger_hash = read_metadata(whole_run / "ledger.parquet")["hash"]
    for fact in (ledger_hash, "9.7 x real time", "eclipse-zenoh 1.10.0", "13 s"):
        assert fact in page.text


def test_the_page_opens_offline_and_stays_below_8_megabytes(page: Page, whole_run: Path) -> None:
    assert page.fetched == []
    assert (whole_run / "report.html").stat().st_size < 8e6


def test_outputs_come_first_and_switching_instants_are_marked(page: Page) -> None:
    signals, switching = page.data["signals"], page.data["switching"]

    assert [entry["name"] for entry in signals] == ["y", "error", "u"]
    assert [curve["label"] for curve in signals[0]["curves"]] == ["r1", "r2", "r3", "r4", "r5"]
    assert switching["media"]["radio"] == pytest.approx([0.5 * k for k in range(1, 26)])
    adopted, = switching["marks"]
    assert adopted["label"] == "topology adopted by a node"
    assert len(adopted["events"]) == 25 * 5


def test_each_interval_stands_at_the_instant_that_ends_it(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "ledger.parquet")
    for number, start_ms in enumerate([1, 4, 9]):
        start = start_ms * 1_000_000
        ledger.expect(1, "radio")
        ledger.close(Frame("radio", "r1", number, start, b"x", on_air_ns=start, end_ns=start + 1), "r2", Fate.LOST)
    ledger.finish()

    gap, = Page(write_report(tmp_path)).data["gaps"]

    assert gap["t_s"] == pytest.approx([0.004, 0.009])
    assert gap["gaps_ms"] == pytest.approx([3.0, 5.0])
    assert gap["transmissions"] == 3


def test_the_fates_on_the_page_add_up_to_the_ledger(page: Page, whole_run: Path) -> None:
    copies = sum(sum(link["fates"].values()) for link in page.data["fates"])

    assert copies == int(read_metadata(whole_run / "ledger.parquet")["rows"])


def test_ninety_five_percent_of_the_drawn_curve_is_the_table_s_figure(page: Page) -> None:
    ages = page.data["ages"]
    where = next(k for k, share in enumerate(ages["shares"]) if abs(share - 0.95) < 1e-12)

    assert len(ages["links"]) == 12
    for link in ages["links"]:
        assert link["ages_ms"][where] == pytest.approx(link["p95_s"] * 1e3, abs=1e-6)
        assert link["ages_ms"][-1] == pytest.approx(link["max_s"] * 1e3, abs=1e-6)


def test_each_frame_of_the_slot_chart_has_the_commonest_fate_of_those_that_missed_it(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "ledger.parquet")

    def send(number: int, *fates: Fate, on_air: bool = True) -> None:
        start = number * 1_000_000
        frame = Frame("radio", "r1", number, start, b"abc", on_air_ns=start if on_air else -1,
                      end_ns=start + 200_000 if on_air else -1)
        for k, fate in enumerate(fates):
            ledger.expect(1, "radio")
            ledger.close(frame, f"r{k + 2}", fate, delivered_ns=start + 300_000 if fate is Fate.DELIVERED else -1)
    send(0, Fate.DELIVERED, Fate.DELIVERED, Fate.DELIVERED)
    send(1, Fate.DELIVERED, Fate.DELIVERED, Fate.LOST)
    send(2, Fate.COLLIDED, Fate.COLLIDED, Fate.DEAF)
    send(3, Fate.SENDER_BUSY, Fate.SENDER_BUSY, on_air=False)
    ledger.finish()

    spoken = Page(write_report(tmp_path)).data["spoken"]

    assert [spoken["outcome"]["names"][code] for code in spoken["outcome"]["codes"]] == [
        "delivered", "lost", "collided", "sender busy"]
    assert (spoken["heard"], spoken["copies"]) == ([3, 2, 0, 0], [3, 3, 3, 2])
    assert spoken["airtime_ms"] == [0.2, 0.2, 0.2, None]
    assert spoken["start_ms"] == [0, 1, 2, 3]


def test_an_empty_folder_gives_a_page_that_says_what_is_missing(tmp_path: Path) -> None:
    text = Page(write_report(tmp_path)).text

    for name in ("scenario.json", "summary.json", "run.json", "ledger.parquet", "signals.mcap"):
        assert f"{name}: not there" in text
    for absent in ("No expectations to judge", "No signals were recorded", "the ledger has no frames",
                   "No link carried a frame", "No node transmitted twice", "No nodes are known",
                   "No events were recorded"):
        assert absent in text


def test_a_run_that_was_killed_gives_a_page_from_what_is_readable(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(tmp_path / "killed", 1.0)
    for name in ("ledger.parquet", "signals.mcap"):
        content = (run / name).read_bytes()
        (run / name).write_bytes(content[:len(content) * 9 // 10])
    (run / "summary.json").unlink()
    (run / "run.json").write_text('{"reached_ns": 4')

    text = Page(write_report(run)).text

    assert "ledger.parquet: unreadable" in text
    assert "signals.mcap: cut off" in text
    assert "run.json: unreadable" in text
    assert "The run left no summary" in text
    assert "radio.delivery_ratio : the run has no such figure" in text


def test_a_run_that_was_broken_off_says_how_far_it_came(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(tmp_path / "short", 1.0)
    facts = json.loads((run / "run.json").read_text())
    (run / "run.json").write_text(json.dumps(facts | {"reached_ns": 250_000_000}))

    assert "broken off at 0.25 s of 1 s" in Page(write_report(run)).text


def test_one_node_that_hears_nobody_has_a_page(tmp_path: Path) -> None:
    Ledger(tmp_path / "ledger.parquet").finish()
    recorder = SignalRecorder(tmp_path / "signals.mcap")
    recorder.declare("alone", [("y1", "rad"), ("y2", "m")])
    recorder.append("alone", 0, (1.0, float("nan")))
    recorder.finish({}, b'{"name": "one", "length_ns": 1000000, "expect": {"frames_lost_on_link": {"max": 0}}}')

    page = Page(write_report(tmp_path))

    assert "The expectation holds" in page.text
    assert page.data["signals"][1]["curves"] == [{"label": "alone", "t_s": [0.0], "values": [None]}]


def test_names_cannot_break_out_of_the_page(tmp_path: Path) -> None:
    bad = "</script><script>alert(1)</script>"
    (tmp_path / "scenario.json").write_text(json.dumps({"name": bad, "question": bad, "expect": {bad: {"max": 1}}}))
    recorder = SignalRecorder(tmp_path / "signals.mcap")
    recorder.declare(bad, [(bad, bad)])
    recorder.append(bad, 0, (1.0,))
    recorder.event(0, bad, bad, bad)
    recorder.finish({})

    page = Page(write_report(tmp_path))

    assert page.scripts == 3
    assert page.data["signals"][0]["name"] == bad


def test_an_expectation_on_a_part_of_the_run_says_which(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(tmp_path / "run", 1.0)
    scenario = json.loads((run / "scenario.json").read_text())
    bound = {"max": 9.0, "during_ns": [250_000_000, 750_000_000]}
    (run / "scenario.json").write_text(json.dumps(scenario | {"expect": {"r1.y.abs_max": bound}}))

    text = Page(write_report(run)).text

    assert "r1.y.abs_max in [0.25, 0.75) s" in text


def test_an_expectation_that_names_nothing_does_not_hold_and_says_why(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(tmp_path / "typo", 0.2)
    scenario = json.loads((run / "scenario.json").read_text())
    (run / "scenario.json").write_text(json.dumps(scenario | {"expect": {"r1.z.last": {"max": 1}}}))

    text = Page(write_report(run)).text

    assert "has a signal 'z'; nearest: r1." in text
    assert "1 of 1 expectations do not hold" in text


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no browser to draw the page with")
def test_a_browser_draws_every_plot(whole_run: Path, tmp_path: Path) -> None:
    report = write_report(whole_run)
    assert BROWSER is not None

    drawn = subprocess.run(
        [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
         f"--user-data-dir={tmp_path}", "--virtual-time-budget=8000", "--dump-dom", report.as_uri()],
        capture_output=True, text=True, timeout=120, check=True).stdout

    assert len(re.findall(r'class="[^"]*js-plotly-plot', drawn)) == 6
    assert drawn.count('class="cartesianlayer"') == 6
    assert "79 frames in this window" in drawn


def test_derived_signals_are_drawn_together_and_first(whole_run: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    shutil.copytree(whole_run, run)
    scenario = json.loads((run / "scenario.json").read_text())
    scenario["path"] = str(run / "own.toml")
    scenario["derived"] = {"gap": {"function": "math_of_the_test:both", "of": ["r1.y", "r2.y"], "parameters": {},
                                   "signals": {"difference": "m", "sum": "m"}}}
    (run / "scenario.json").write_text(json.dumps(scenario))
    (run / "math_of_the_test.py").write_text("def both(a, b):\n    return a - b, a + b\n")

    page = Page(write_report(run))

    first = page.data["signals"][0]
    assert (first["name"], first["unit"]) == ("gap: difference, sum", "m")
    assert [curve["label"] for curve in first["curves"]] == ["difference", "sum"]
    assert "gap" not in page.data["nodes"]
