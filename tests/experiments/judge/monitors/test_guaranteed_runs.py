"""Guarantees of emulated runs whose instants follow from the schedule.

Frames at k 10 ms, 80 us on the air, at their receiver 20 us later.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from html import unescape
from pathlib import Path

import pytest
from click.testing import CliRunner

from experiments.judge.run_data import RunData, load_run
from experiments.judge.run_result import RunResult
from experiments.run.runner import run
from experiments.scenario import ScenarioError, find, load
from marconet.command_line import app
from netem.wire.errors import NodeFailure

ROBOTS = '''
from dataclasses import dataclass


class Talker:
    """Ten bytes every 10 ms from offset_ns on, and once more at each instant of `extra_ms`; reports a gain at 25 ms."""

    @dataclass
    class Settings:
        offset_ns: int = 0
        extra_ms: tuple[int, ...] = ()
        dies_ms: int = 0

    def __init__(self, board, settings):
        self.board, self.dies_ms = board, settings.dies_ms
        self.port = board.port("radio", lambda frame: None)
        self.instants = sorted([settings.offset_ns + k * 10_000_000 for k in range(100)]
                               + [ms * 1_000_000 for ms in settings.extra_ms])
        board.record("gain", "1", lambda: 0.5 if board.now_ns < 30_000_000 else 1.5)

    def run(self):
        told = False
        for instant in self.instants:
            if instant > 25_000_000 and not told:
                yield from self.board.sleep_until(25_000_000)
                self.board.event("gain product", "1.25 at 25 ms")
                told = True
            yield from self.board.sleep_until(instant)
            if self.dies_ms and instant >= self.dies_ms * 1_000_000:
                raise RuntimeError("dies")
            self.port.send(bytes(10))
'''
SCENARIO = """
# Question: are the guarantees kept?
seed = 1
length_s = 0.1
[agents.a]
program = "robots_of_the_guarantees:Talker"
[agents.b]
program = "robots_of_the_guarantees:Talker"
parameters = { offset_ms = 5 }
[media.radio]
kind = "broadcast_radio"
bit_rate_bps = 1_000_000
preamble_us = 0
header_bits = 0
receive_latency_us = 20
[[impairments]]
on = "radio: a -> b"
kind = "scripted_loss"
lose_frames = [3, 4, 5, 8]
[guarantees.losses]
kind = "successive_losses"
on = "radio: * -> *"
at_most = 1
[guarantees.fresh]
kind = "age_of_information"
on = "radio: * -> b"
below_ms = 25
[guarantees.apart]
kind = "inter_transmission_time"
on = "radio: a"
at_least_ms = 10
[guarantees.sampled]
kind = "signal"
on = "a.gain"
below = 1.0
[guarantees.told]
kind = "reported"
on = "a.gain product"
below = 1.0
"""
US, MS = 1_000, 1_000_000
LOSS = "(impairments[0] scripted_loss)"


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "robots_of_the_guarantees.py").write_text(ROBOTS)
    (tmp_path / "talk.toml").write_text(SCENARIO)
    yield tmp_path / "talk.toml"
    sys.modules.pop("robots_of_the_guarantees", None)


def ran(path: Path, *overrides: str, host: str = "inline", report: bool = False) -> tuple[RunResult, RunData]:
    out = path.parent / f"run-{host}"
    result = run(load(path, overrides=overrides), host=host, out=out, report=report)      # type: ignore[arg-type]
    return result, load_run(out)


def told(data: RunData) -> list[tuple[int, str, str]]:
    return [(event.time_ns, event.node, event.detail) for event in data.events if event.kind == "guarantee violated"]


def test_each_violation_is_recorded_at_its_instant_with_its_cause(scenario: Path) -> None:
    result, data = ran(scenario)

    assert told(data) == [
        (25 * MS, "a", "told: a.gain product: it is 1.25 at 25 ms; until 0.1 s (below 1)"),
        (30 * MS, "a", "sampled: a.gain: it is 1.5; until 0.1 s (below 1)"),
        (40 * MS + 80 * US, "b", f"losses: radio: a -> b: frames 3, 4 lost {LOSS}; until 0.0601 s "
                                 "(at most 1 successive losses)"),
        (45 * MS, "b", f"fresh: radio: a -> b: no news since the frame handed out at 0.02 s: frames 3, 4 lost {LOSS}; "
                       "until 0.0601 s (age of information below 0.025 s)"),
    ]
    standings = {standing.name: standing for standing in result.summary.guarantees}
    assert standings["losses"].worst == 3.0
    assert standings["fresh"].violated_ns == 60 * MS + 100 * US - 45 * MS
    assert standings["fresh"].worst == pytest.approx(0.0401, rel=1e-12)
    assert (standings["apart"].violations, standings["apart"].margin) == (0, 0.0)
    assert not result.summary.holds
    assert [verdict.key for verdict in result.summary.verdicts if not verdict.holds] == [
        f"guarantee.{name}.violations" for name in ("losses", "fresh", "sampled", "told")]


def test_robots_as_processes_leave_the_same_outcomes(scenario: Path) -> None:
    inline, inline_data = ran(scenario)
    process, process_data = ran(scenario, host="process")

    assert process.summary.ledger_hash == inline.summary.ledger_hash
    assert process_data.guarantees == inline_data.guarantees
    assert told(process_data) == told(inline_data)


def test_the_report_has_each_guarantee_its_violations_and_a_mark_at_each(scenario: Path) -> None:
    result, _ = ran(scenario, report=True)

    page = (result.folder / "report.html").read_text(encoding="utf-8")
    text = unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", page.partition("<script")[0])))
    assert "losses at most 1 successive losses radio: * -> * 3 -2 1 × 0.02002 s 0.04008 s ✗ violated" in text
    assert "apart at least 0.01 s from one frame handed out to the next radio: a 0.01 s 0 s 0 × 0 s ✓ holds" in text
    assert ("0.045 s guarantee violated fresh radio: a -> b until 0.0601 s no news since the frame handed out at "
            "0.02 s radio: a -> b: 2 frames lost " + LOSS) in text
    assert "gain product: 2 · guarantee violated: 4 (above, under what broke)" in text
    drawn = json.loads(page.partition('<script id="data" type="application/json">')[2].partition("</script>")[0])
    marked = {mark["label"]: [event["t_s"] for event in mark["events"]] for mark in drawn["switching"]["marks"]}
    assert marked == {"guarantee violated": pytest.approx([0.025, 0.03, 0.04008, 0.045])}
    assert [0.045, 0.0601] in [pytest.approx([stretch["from_s"], stretch["until_s"]]) for stretch in drawn["violated"]]
    assert len(drawn["violated"]) == sum(standing.violations for standing in result.summary.guarantees)


def test_figures_of_a_guarantee_can_be_expected(scenario: Path) -> None:
    scenario.write_text(SCENARIO + """
[expect]
"guarantee.losses.violations" = { min = 1, max = 1 }
"guarantee.fresh.first_violation_s" = { min = 0.045, max = 0.045 }
"guarantee.fresh.violated_s" = { min = 0.015, max = 0.016 }
"guarantee.fresh.margin_s" = { max = -0.015 }
"guarantee.apart.worst_s" = { min = 0.01 }
"guarantee.apart.first_violation_s" = { min = 0.0 }
"guarantee.told.violations" = { min = 1 }
"guarantee.sampled.worst" = { max = 1.5 }
"guarantee.sampled.violations" = { min = 1 }
""")

    result, _ = ran(scenario, "guarantees.fresh.expected='violated'")

    held = {verdict.key: (verdict.value, verdict.holds) for verdict in result.summary.verdicts}
    assert held["guarantee.fresh.violations"] == (1.0, True)
    assert held["guarantee.apart.first_violation_s"] == (None, False)       # there is none
    assert [key for key, (_, holds) in held.items() if not holds] == ["guarantee.apart.first_violation_s"]


def test_a_collision_is_named_as_the_cause_and_frames_too_early_are_seen(scenario: Path) -> None:
    _, data = ran(scenario, "agents.a.parameters.extra_ms=[52]", "agents.b.parameters.offset_us=50", "impairments=[]",
                  "guarantees.losses.at_most=4")

    # a speaks in [0, 80) us of every 10 ms and b in [50, 130): each is deaf to the other, but for a's frame at 52 ms
    found = {(time, detail.partition(":")[0]): detail for time, _, detail in told(data)}
    assert (52 * MS, "apart") in found
    assert found[52 * MS, "apart"] == (
        "apart: radio: a: frames 5 and 6 handed out 0.002 s apart, and 1 more too early after them; until 0.062 s "
        "(at least 0.01 s from one frame handed out to the next)")
    assert "frames 0, 1, 2, 3 and 1 more deaf" in found[40 * MS + 80 * US, "losses"]


def test_a_signal_that_no_node_has_is_refused_before_time_starts(scenario: Path) -> None:
    with pytest.raises(ScenarioError) as error:
        ran(scenario, "guarantees.sampled.on='a.gian'")

    assert error.value.problems == ["talk.toml: guarantees.sampled.on='a.gian': no such signal; did you mean \"gain\"?"]


def test_a_run_that_is_broken_off_is_judged_up_to_there(scenario: Path) -> None:
    with pytest.raises(NodeFailure):
        ran(scenario, "agents.b.parameters.dies_ms=65")

    data = load_run(scenario.parent / "run-inline")
    assert data.guarantees["losses"].violations[0].from_ns == 40 * MS + 80 * US
    assert data.guarantees["told"].violations[0].until_ns == data.length_ns < 100 * MS
    assert (40 * MS + 80 * US, "b") in {(time, node) for time, node, _ in told(data)}


def test_a_run_without_guarantees_has_no_file_of_them(scenario: Path) -> None:
    scenario.write_text(SCENARIO.partition("[guarantees.losses]")[0])

    result, data = ran(scenario)

    assert (result.summary.guarantees, data.guarantees, data.missing) == ([], {}, [])
    assert not (result.folder / "guarantees.json").exists()


def test_the_command_exits_with_1_and_names_instant_and_cause(scenario: Path) -> None:
    result = CliRunner().invoke(app, ["run", str(scenario), "--host", "inline", "--out", str(scenario.parent / "out"),
                                      "--set", "guarantees.told.expected='violated'"], env={"COLUMNS": "200"})

    assert result.exit_code == 1
    lines = result.stderr.splitlines()
    assert "expect.guarantee.losses.violations=1.0: 1 above the most allowed, 0" in lines
    assert (f"guarantees.losses: violated once, 0.02002 s in all, first at 0.04008 s on radio: a -> b: "
            f"frames 3, 4 lost {LOSS}") in lines
    assert not any(line.startswith("guarantees.told") for line in lines)
    assert "at most 1 successive losses" in result.stdout


def test_the_losses_that_the_slots_were_cut_for_are_guaranteed_in_output_sync_lossy(tmp_path: Path) -> None:
    scenario = load(find("output_sync_lossy"), duration_s=0.4, overrides=[
        "impairments[0].lose_frames=[1, 2]", "impairments[0].every=50"])

    result = run(scenario, host="inline", out=tmp_path, report=False)

    standing, = result.summary.guarantees
    assert (standing.worst, standing.as_expected) == (2.0, False)
    assert scenario.guarantees[standing.name].fields["at_most"] == scenario.team["max_successive_losses"]
