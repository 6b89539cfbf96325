"""Whole games on the emulator: who detects, who is deployed, who captures, and what is refused."""

from __future__ import annotations

import re
from collections import Counter
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario import ScenarioError, find, load
from experiments.scenario.loader import load_tables
from netem.records.event_fields import read

S, MS = 1_000_000_000, 1_000_000
EXPOSURE_NS, LATENCY_NS, WINDOW_NS, SLOT_NS = 100 * MS, 20 * MS, 150 * MS, 5 * MS
SEED = 121                      # a game with two captures, three investigations and a pursuit
TARGETS = ("target_1", "target_2", "target_3")
LOSSES = "impairments=[{on='radio: * -> *', kind='scripted_loss', lose_frames=[0], every=2}]"


def played(out: Path, seed: int = SEED, *overrides: str, host: Any = "inline") -> tuple[RunData, Any]:
    scenario = load(find("marco_polo"), seed=seed, overrides=overrides)
    summary = run(scenario, host=host, out=out, report=False).summary
    return load_run(out), summary


def counted(data: RunData, counter: str) -> int:
    return sum(counters.get(counter, 0) for counters in data.counters.values())


def told(data: RunData, kind: str, start: str = "") -> list[tuple[str, int, str]]:
    return [(event.node, event.time_ns, event.detail) for event in data.events
            if event.kind == kind and event.detail.startswith(start)]


def test_both_hosts_have_one_ledger(tmp_path: Path) -> None:
    _, inline = played(tmp_path / "inline")
    _, process = played(tmp_path / "process", host="process")

    assert inline.ledger_hash == process.ledger_hash


def test_sensors_detect_exactly_what_truth_puts_into_their_fields_of_view(tmp_path: Path) -> None:
    data, _ = played(tmp_path / "run")

    team: Any = data.scenario["team"]
    places = {}
    for name in (*TARGETS, *team["sensors"]):
        table = data.signals[name]
        columns = [list(table.names).index(axis) for axis in ("x", "y")]
        places[name] = dict(zip(np.asarray(table.time_ns).tolist(), np.asarray(table.values)[:, columns].tolist(),
                                strict=True))
    expected = set()
    for sensor, radius_m in team["radius_m"].items():
        for target in TARGETS:
            seen_ns = [at_ns for at_ns, (x, y) in places[target].items()
                       if at_ns % EXPOSURE_NS == 0 and at_ns + LATENCY_NS < 60 * S
                       and hypot(x - places[sensor][at_ns][0], y - places[sensor][at_ns][1]) <= radius_m]
            if seen_ns:
                expected.add((sensor, target, min(seen_ns) + LATENCY_NS))
    found = {(node, read(detail)["target"], time_ns) for node, time_ns, detail in told(data, "detection")}
    assert len(expected) >= 8
    assert found == expected


@pytest.mark.parametrize("losses", [(), (LOSSES,)], ids=["no loss", "every second frame lost"])
def test_one_sensor_is_deployed_for_each_task_within_a_window(losses: tuple[str, ...], tmp_path: Path) -> None:
    data, summary = played(tmp_path / "run", SEED, *losses)

    assert summary.holds
    deployed = Counter(detail.rpartition(",")[0] for _, _, detail in told(data, "deployed"))
    assert deployed
    assert set(deployed.values()) == {1}
    opened_ns: dict[str, int] = {}
    for _, time_ns, detail in told(data, "window open"):
        opened_ns.setdefault(detail.partition(" by ")[0], time_ns)
    for _, time_ns, detail in told(data, "deployed"):
        task = detail.rpartition(",")[0]
        assert WINDOW_NS <= time_ns - opened_ns[task] <= WINDOW_NS + SLOT_NS
    assert counted(data, "let go") == 0


@pytest.mark.parametrize("seed", [100, 105, SEED, 155])
def test_a_target_is_captured_once_by_a_ugv_that_touches_it(seed: int, tmp_path: Path) -> None:
    data, summary = played(tmp_path / "run", seed)

    assert summary.holds
    captures = [(node, time_ns, read(detail)["target"]) for node, time_ns, detail in told(data, "capture")]
    assert len({target for _, _, target in captures}) == len(captures) == counted(data, "captures")
    assert counted(data, "captured") == len(captures)
    for node, _, target in captures:
        assert node.startswith("ugv")
        last, = (detail for name, _, detail in told(data, "mode", "inside -> captured") if name == target)
        assert f" by {node}: gripped" in last
    assert not [node for node, _, detail in told(data, "mode", "waiting -> pursuing") if node.startswith("uav")]
    for node, time_ns, detail in told(data, "mode", "waiting -> investigating"):
        target = TARGETS[int(float(detail.partition(" with of=")[2].partition(",")[0]))]
        own = [at_ns for name, at_ns, _ in told(data, "detection", f"target={target} ") if name == node]
        assert all(at_ns > time_ns for at_ns in own)        # a second detection by it would not be independent
    assert counted(data, "captured") + counted(data, "left") <= counted(data, "entered") == 3


def test_a_game_without_targets_deploys_nobody(tmp_path: Path) -> None:
    late = [f"agents.{target}.parameters.enter_s=100" for target in TARGETS]

    data, _ = played(tmp_path / "run", SEED, *late, "expect={}")

    counts = {counter: counted(data, counter) for counter in (
        "entered", "detections", "windows", "deployments", "investigations", "pursuits", "captures")}
    assert set(counts.values()) == {0}
    assert len(told(data, "mode")) == 10                # each robot's start


def test_an_investigation_that_finds_nothing_ends(tmp_path: Path) -> None:
    data, _ = played(tmp_path / "run")

    ended = told(data, "mode", "investigating -> waiting")
    late = [detail for _, _, detail in ended if detail.endswith(": the target has left its C-target")]
    assert len(late) == counted(data, "investigations without a detection") == 1
    assert len(ended) == counted(data, "investigations")


def test_a_pursuit_that_finds_nothing_ends(tmp_path: Path) -> None:
    data, _ = played(tmp_path / "run", 100)

    ended = told(data, "mode", "pursuing -> waiting")
    assert counted(data, "pursuits without a capture") == 1
    assert ended[-1][2].endswith(": the target is not where it was expected to leave")


def test_of_two_ugvs_that_grip_at_once_one_captures(tmp_path: Path) -> None:
    grippers = {f"ugv_{number}": {"program": "tests.agents.marco_polo_game.grippers:Gripper", "media": ["grip"],
                                  "parameters": {"number": number, "at_ns": 2 * S}} for number in (0, 1)}
    target = {"program": "agents.marco_polo_game.target_robot:TargetRobot", "media": ["grip"],
              "parameters": {"enter_ns": S}, "plant": {"fmu": "omnidirectional", "parameters": {"x": -5.0}}}
    scenario = load_tables({
        "seed": 1, "length_ns": 3 * S, "agents": {"target": target, **grippers},
        "team": {"sensors": ["ugv_0", "ugv_1"], "ugvs": ["ugv_0", "ugv_1"], "targets": ["target"],
                 "radius_m": {"ugv_0": 1.0, "ugv_1": 1.0}, "area_x_m": [0.0, 10.0], "area_y_m": [0.0, 10.0]},
        "media": {"grip": {"kind": "broadcast_radio", "preset": "wifi_broadcast_80211b_1mbps", "decode": "local"}}},
        "Question: who captures?", Path("grip.toml").absolute())

    summary = run(scenario, host="inline", out=tmp_path / "run", report=False).summary

    counters = load_run(tmp_path / "run").counters
    assert summary.holds
    assert counters["target"]["captured"] == 1
    assert {name: counters[name] for name in grippers} == {
        "ugv_0": {"held by 0": 1}, "ugv_1": {"held by 0": 1}}     # the first answer keeps the radio busy


@pytest.mark.parametrize(("override", "said"), [
    ("team.radius_m.ugv_1=1.2", "team.radius_m.ugv_1=1.2: media.view_ugv has range_m=1.0; take the same"),
    ("agents.ugv_1.parameters.exposure_ms=70", "media.view_ugv has exposures every 100000000 ns; take the same"),
    ("team.ugvs=[]", "team.ugvs: 0 UGVs, and a UAV cannot capture; add at least 1 UGV"),
    ("team.ugvs=['ugv_1', 'ugv_2', 'ugv_3', 'ugv_4']", "agents.ugv_5: runs the program of a UGV and is missing"),
    ("team.targets=['target_1', 'target_2']", "target_3 is missing; frames number the targets by this list"),
    ("team.game={detections=1}", "k is 2 or more"),
    ("team.game={ugv_mps=0.5}", "make it faster, or the target slower"),
    ("team.game={least_area_coverage=0.4}", "take 0.3337 or less"),
    ("team.game={cell_m=0.3}", "is not a whole number of cells"),
    ("team.game={speed=1}", "speed: expected keys among"),
    ("agents.target_1.parameters.enter_s=0", "(enter_ns=0): expected more than 1000000"),
    ("agents.uav_1.parameters.window_ms=100", "the bid window is shorter than its frames"),
])
def test_what_cannot_be_played_is_refused_with_what_would_do(override: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(said)):
        load(find("marco_polo"), overrides=[override])
