"""The page is read as a browser would read its parts; what it says is compared with the run folder it was made from."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.judge.run_data import load_run
from experiments.show.report import series
from experiments.show.report.build import size, write_report
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.records.events import Event
from netem.records.ledger import Ledger
from netem.records.ledger_file import read_ledger, read_metadata
from netem.records.signals import SignalFile

MakeRun = Callable[[Path, float], Path]


class Page(HTMLParser):
    """Text outside scripts and styles, the JSON element, and every address that a tag would fetch."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.fetched: list[str] = []
        self.links: list[str] = []
        self.ids: list[str] = []
        self.moments: list[tuple[float, str]] = []
        self.scripts = 0
        self.json = ""
        self._in_json = False
        self.source = path.read_text(encoding="utf-8")
        self.feed(self.source)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.open.append(tag)
        self.scripts += tag == "script"
        self._in_json = dict(attrs).get("id") == "data"
        found = {name: value or "" for name, value in attrs}
        self.fetched += [found[name] for name in ("src", "href")
                         if name in found and tag != "a" and found[name] != "data:,"]
        self.links += [found["href"]] if tag == "a" else []
        self.ids += [found["id"]] if "id" in found else []
        self.moments += [(float(found["data-t"]), found["data-words"])] if "data-t" in found else []

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


def test_the_contents_name_every_section_and_lead_to_it(page: Page) -> None:
    sections = re.findall(r'<section id="(\w+)">', page.source)

    assert [link for link in page.links if link.startswith("#")][:len(sections) + 1] == [
        "#top", *(f"#{section}" for section in sections)]
    assert {link[1:] for link in page.links if link.startswith("#")} <= set(page.ids)


def test_every_record_that_is_there_has_a_link(page: Page, whole_run: Path) -> None:
    linked = [link for link in page.links if not link.startswith("#")]

    assert sorted(linked) == sorted(path.name for path in whole_run.iterdir() if path.name != "report.html")


def test_every_fate_that_occurs_is_explained_and_no_other(page: Page) -> None:
    occurring = {fate for link in page.data["fates"] for fate in link["fates"]}

    assert {fate.value for fate in Fate if fate.meaning in page.text} == occurring == {"delivered", "lost", "collided"}
    assert page.data["meanings"] == {fate.value: fate.meaning for fate in Fate}


def test_each_broken_expectation_leads_to_an_instant(page: Page, whole_run: Path) -> None:
    ledger = read_ledger(whole_run / "ledger.parquet")
    offered_ns, fates = np.asarray(ledger["offered_ns"]), np.asarray(ledger["fate"])
    first_missing_s = offered_ns[fates != "delivered"].min() / 1e9

    (t_s, words), *_ = page.moments

    assert t_s == pytest.approx(first_missing_s, abs=1e-9)
    assert words.startswith("radio.delivery_ratio, radio: ")
    assert any(abs(start_ms / 1e3 - first_missing_s) < 1e-3 for start_ms in page.data["spoken"]["start_ms"])


def test_the_slot_chart_holds_frames_around_what_broke(whole_run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(series, "MOST_TRANSMISSIONS", 100)
    whole = series.spoken(load_run(whole_run))

    around = series.spoken(load_run(whole_run), [6_000_000_000])

    first_ms, more_ms = around["start_ms"][:100], around["start_ms"][100:]
    assert first_ms == whole["start_ms"]
    assert around["until_s"] == whole["until_s"] == pytest.approx(first_ms[-1] / 1e3)
    assert 5750 <= more_ms[0] < 5752
    assert 6248 < more_ms[-1] < 6250
    assert around["rows"] == len(around["start_ms"]) == len(around["number"])


def test_a_run_that_failed_says_so_in_words_on_top(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(tmp_path / "failed", 1.0)
    facts = json.loads((run / "run.json").read_text())
    words = "NodeFailure: r3 died of signal 11 (SIGSEGV) at 0.25 s"
    (run / "run.json").write_text(json.dumps(facts | {"reached_ns": 250_000_000, "failure": words}))

    page = Page(write_report(run))

    text = page.text
    assert page.moments[0] == (0.25, "the run failed")
    assert f"The run failed {words} The run was broken off at 0.25 s of 1 s" in text
    assert text.index("The run failed") < text.index("expectation")


def test_what_the_summary_tells_of_a_failure_is_shown_with_the_last_report(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(tmp_path / "failed", 1.0)
    summary = json.loads((run / "summary.json").read_text())
    told = {"failure": "r3 gave no answer for 30 s", "last_report": "window 17, promise 0.26 s"}
    (run / "summary.json").write_text(json.dumps(summary | told))

    text = Page(write_report(run)).text

    assert "The run failed r3 gave no answer for 30 s" in text
    assert "Last report of the node: window 17, promise 0.26 s" in text


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


def test_what_the_summary_warns_of_is_shown(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(tmp_path / "warned", 0.2)
    summary = json.loads((run / "summary.json").read_text())
    (run / "summary.json").write_text(json.dumps(summary | {"warnings": ["r1 sent 3 frames that are too long"]}))

    assert "r1 sent 3 frames that are too long" in Page(write_report(run)).text


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
    recorder = SignalFile(tmp_path / "signals.mcap")
    recorder.declare("alone", [("y1", "rad"), ("y2", "m")])
    recorder.append("alone", 0, (1.0, float("nan")))
    recorder.finish({}, b'{"name": "one", "length_ns": 1000000, "expect": {"frames_lost_on_link": {"max": 0}}}')

    page = Page(write_report(tmp_path))

    assert "The expectation holds" in page.text
    assert page.data["signals"][1]["curves"] == [{"label": "alone", "t_s": [0.0], "values": [None]}]


def test_names_cannot_break_out_of_the_page(tmp_path: Path) -> None:
    bad = "</script><script>alert(1)</script>"
    (tmp_path / "scenario.json").write_text(json.dumps({"name": bad, "question": bad, "expect": {bad: {"max": 1}}}))
    recorder = SignalFile(tmp_path / "signals.mcap")
    recorder.declare(bad, [(bad, bad)])
    recorder.append(bad, 0, (1.0,))
    recorder.event(Event(0, bad, bad, bad))
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


@pytest.mark.parametrize(("size_bytes", "text"), [(0, "0 B"), (999, "999 B"), (1_000, "1.0 kB"), (99_949, "99.9 kB"),
                                                  (99_950, "100 kB"), (999_999, "1.0 MB"), (2_345_678_901, "2.3 GB")])
def test_sizes_have_a_unit_of_their_own(size_bytes: int, text: str) -> None:
    assert size(size_bytes) == text
