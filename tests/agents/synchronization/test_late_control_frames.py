"""Delays that keep discovery from ending are refused before the start, at the nanosecond at which they begin to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from random import Random
from typing import Any

import pytest

from agents.synchronization.preparation import frame_layout
from agents.synchronization.robot import SyncRobot
from agents.synchronization.team import read_team
from experiments.judge.run_data import load_run
from experiments.run.node_build import build_node
from experiments.run.node_specifications import node_specifications
from experiments.run.runner import run
from experiments.scenario import Scenario, ScenarioError, find, load
from netem.core.transit import Transit
from netem.impairments.delay import Delay
from netem.impairments.rate_limit import RateLimit
from netem.impairments.trace import Trace

LINKS = ["r2 -> r1", "r4 -> r1", "r3 -> r2", "r5 -> r3", "r1 -> r4", "r2 -> r4", "r3 -> r5", "r4 -> r5"]
FIXED = f"media.radio.topology={{kind='fixed', links={LINKS}}}"
# By hand: slots of the start last 1 ms; 100.5 us data and 104.5 us control leave 795 us free, of which two thirds lie
# before the control frame: 1 000 000 - (100 500 + 530 000) = 369 500 ns from its start to the end of the slot.
REST_NS = 369_500


def delayed(delay: str, on: str = "radio: r5 -> r3", more: Sequence[str] = ()) -> Scenario:
    return load(find("output_sync"), duration_s=0.3, overrides=[FIXED, "expect={}", *more,
                                                                f"impairments=[{{ on='{on}', {delay} }}]"])


def refusal(delay: str, on: str = "radio: r5 -> r3", more: Sequence[str] = ()) -> str:
    with pytest.raises(ScenarioError) as error:
        delayed(delay, on, more)
    line, = error.value.problems
    return line


def test_the_longest_delay_that_passes_lets_discovery_end(tmp_path: Path) -> None:
    scenario = delayed(f"kind='delay', delay_ns={REST_NS - 1}")

    run(scenario, host="inline", out=tmp_path, report=False)

    events = Counter(event.kind for event in load_run(tmp_path).events)
    assert (events["adopted topology"], events["fell back"]) == (5, 0)


def test_one_nanosecond_more_is_refused_and_would_never_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    line = refusal(f"kind='delay', delay_ns={REST_NS}")

    monkeypatch.setattr(SyncRobot, "check", staticmethod(lambda scenario, own: ()))
    run(delayed(f"kind='delay', delay_ns={REST_NS}"), host="inline", out=tmp_path, report=False)
    events = Counter(event.kind for event in load_run(tmp_path).events)
    assert events["adopted topology"] == 0
    assert events["fell back"] > 10
    assert line.startswith("output_sync.toml: impairments[0]: radio: r5 -> r3: every control frame comes at least "
                           f"{REST_NS} ns late")
    assert f"expected less than {REST_NS} ns, the rest of the control sub-slot (a slot of 1000000 ns less its offset "\
           "of 630500 ns)" in line


def test_the_slot_of_the_start_that_it_recommends_is_enough(tmp_path: Path) -> None:
    line = refusal("kind='delay', delay_us=600")
    recommended = line.partition("team.boot_slot_s to ")[2].split()[0]

    scenario = delayed("kind='delay', delay_us=600", more=[f"team.boot_slot_s={recommended}"])
    run(scenario, host="inline", out=tmp_path, report=False)

    assert Counter(event.kind for event in load_run(tmp_path).events)["adopted topology"] >= 5
    less = float(recommended) - 3e-6            # the recommendation is rounded up to a microsecond and a quantum
    assert "600000 ns late" in refusal("kind='delay', delay_us=600", more=[f"team.boot_slot_s={less:.6f}"])


@pytest.mark.parametrize(("delay", "late_ns"), [
    ("kind='delay', delay_us=400, distribution='uniform', jitter_us=20", 380_000),
    ("kind='delay', distribution='empirical', samples_us=[900, 500, 700]", 500_000),
    ("kind='delay', distribution='empirical', quantiles_us=[400, 500, 900]", 400_000),
    ("kind='delay', delay_us=370, during_s=[0.0, 0.3]", 370_000),
])
def test_what_every_frame_is_delayed_by_counts(delay: str, late_ns: int) -> None:
    assert f"at least {late_ns} ns late" in refusal(delay)


@pytest.mark.parametrize("delay", [
    "kind='delay', delay_us=400, distribution='uniform', jitter_us=31",
    "kind='delay', delay_us=400, distribution='normal', jitter_us=60",
    "kind='delay', delay_us=900, during_s=[0.1, 0.2]",
    "kind='reorder', hold_us=900, reorder_ratio=0.5",
])
def test_a_delay_that_spares_some_frames_or_some_time_does_not(delay: str) -> None:
    assert delayed(delay).impairments[0].links == (("radio", "r5", "r3"),)


def test_a_link_that_the_radio_does_not_have_does_not_matter() -> None:
    assert delayed("kind='delay', delay_us=900", on="radio: r3 -> r1").impairments


def test_delays_of_one_link_add_up() -> None:
    with pytest.raises(ScenarioError) as error:
        load(find("output_sync"), overrides=[
            FIXED, "expect={}", "impairments=[{ on='radio: * -> *', kind='delay', delay_us=200 }, "
                                "{ on='radio: r5 -> r3', kind='delay', delay_us=180 }]"])

    line, = error.value.problems
    assert "impairments[0] and impairments[1]: radio: r5 -> r3: every control frame comes at least 380000 ns" in line


def test_clocks_that_differ_may_hide_a_guard_time() -> None:
    """The guard is 20 us; a receiver whose clock is behind sees the frame that much earlier."""
    behind = ["agents.r3.clock.offset_us=-10", "agents.r5.clock.offset_us=10"]

    assert delayed(f"kind='delay', delay_ns={REST_NS + 19_999}", more=behind)
    assert "impairments[0]" in refusal(f"kind='delay', delay_ns={REST_NS + 20_000}", more=behind)


def test_told_robots_need_no_control_sub_slot() -> None:
    scenario = load(find("output_sync_reference"), overrides=[
        "impairments=[{ on='*: * -> *', kind='delay', delay_us=300 }]", "expect={}"])

    assert len(scenario.impairments) == 1


def test_the_offset_reckoned_with_is_the_robots_own() -> None:
    scenario = load(find("output_sync"))
    layout = frame_layout(read_team(scenario.team), scenario.media["radio"])
    robots: list[Any] = []
    specification = node_specifications(scenario)["r1"]
    original = SyncRobot.__init__

    def remember(self: SyncRobot, *args: Any, **kwargs: Any) -> None:
        original(self, *args, **kwargs)
        robots.append(self)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SyncRobot, "__init__", remember)
        build_node(specification)

    schedule = robots[0]._schedule
    assert schedule.control_offset_ns == layout.control_offset_ns(schedule.slot_ns)
    assert schedule.slot_ns - schedule.control_offset_ns == REST_NS


@pytest.mark.parametrize("kind", ["uniform", "normal", "pareto", "paretonormal"])
def test_no_copy_undercuts_the_least_delay(kind: Any) -> None:
    """Over draws and at the least that a draw can be."""
    class Least(Random):
        def random(self) -> float:
            return 0.0
    drawn = Delay(100_000, kind, 20_000, rng=Random(1))
    least = drawn.least_delay_ns(10)

    delays = [copy.arrival_ns for k in range(3000) for copy in drawn.carry(Transit(k, 0, 0, b""))]
    at_zero, = Delay(100_000, kind, 20_000, rng=Least()).carry(Transit(0, 0, 0, b""))
    assert at_zero.arrival_ns == least <= min(delays)


def test_the_least_delays_of_a_rate_limit_and_of_a_trace(tmp_path: Path) -> None:
    (tmp_path / "trace.csv").write_text("delay_us,lost\n70,0\n5,1\n40,0\n")
    limit = RateLimit(rate_bps=1_000_000, overhead_bytes=2)

    carried, = limit.carry(Transit(0, 0, 0, bytes(8)))

    assert limit.least_delay_ns(8) == carried.arrival_ns == 80_000
    assert Trace(str(tmp_path / "trace.csv")).least_delay_ns(8) == 40_000
