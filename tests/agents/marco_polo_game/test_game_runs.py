"""Whole games on the emulator: who detects, who is deployed, who captures, and what is refused."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import shapely

from agents.marco_polo.reward import RewardWeights
from agents.marco_polo_game.game_table import game_of
from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario import ScenarioError, find, load
from experiments.scenario.loader import load_tables
from netem.records.event_fields import read
from tests.agents.marco_polo_game.games import counted, told
from tests.agents.marco_polo_game.games import played as play

S, MS = 1_000_000_000, 1_000_000
EXPOSURE_NS, LATENCY_NS, WINDOW_NS, SLOT_NS = 100 * MS, 20 * MS, 150 * MS, 5 * MS
SEED = 121                      # a game with two captures, three investigations and a pursuit
TARGETS = ("target_1", "target_2", "target_3")
LOSSES = "impairments=[{on='radio: * -> *', kind='scripted_loss', lose_frames=[0], every=2}]"


def played(out: Path, seed: int = SEED, *overrides: str, host: Any = "inline",
           name: str = "marco_polo") -> tuple[RunData, Any]:
    return play(out, name, *overrides, seed=seed, host=host)


def task_of(detail: str) -> tuple[str, ...]:
    """A task and the epoch of its window, as an event of bidding names them."""
    fields = read(detail)
    return tuple(fields[name] for name in ("target", "for", "stage", "epoch"))


@pytest.mark.slow
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


@pytest.mark.parametrize("losses", [pytest.param((), marks=pytest.mark.slow), (LOSSES,)],
                         ids=["no loss", "every second frame lost"])
def test_one_sensor_is_deployed_for_each_task_within_a_window(losses: tuple[str, ...], tmp_path: Path) -> None:
    data, summary = played(tmp_path / "run", SEED, *losses)

    assert summary.holds
    deployed = Counter(task_of(detail) for _, _, detail in told(data, "deployed"))
    assert deployed
    assert set(deployed.values()) == {1}
    opened_ns: dict[tuple[str, ...], int] = {}
    for _, time_ns, detail in told(data, "window open"):
        opened_ns.setdefault(task_of(detail), time_ns)
    for _, time_ns, detail in told(data, "deployed"):
        assert WINDOW_NS <= time_ns - opened_ns[task_of(detail)] <= WINDOW_NS + SLOT_NS
    assert counted(data, "let go") == 0


@pytest.mark.parametrize("seed", [100, SEED, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (105, 155))])
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


def gripped(out: Path, at_ns: tuple[int, int] = (2 * S, 2 * S), losses: int = 0, capture_m: float = 20.0,
            impairments: Any = ()) -> Mapping[str, Mapping[str, int]]:
    """Counters after two UGVs in the middle have gripped a target that is somewhere in the area."""
    grippers = {f"ugv_{number}": {"program": "tests.agents.marco_polo_game.grippers:Gripper", "media": ["grip"],
                                  "parameters": {"number": number, "at_ns": at_ns[number]}} for number in (0, 1)}
    target = {"program": "agents.marco_polo_game.target_robot:TargetRobot", "media": ["grip"],
              "parameters": {"enter_ns": S, "max_successive_losses": losses},
              "plant": {"fmu": "omnidirectional", "parameters": {"x": -5.0}}}
    scenario = load_tables({
        "seed": 1, "length_ns": 3 * S, "agents": {"target": target, **grippers},
        "team": {"sensors": ["ugv_0", "ugv_1"], "ugvs": ["ugv_0", "ugv_1"], "targets": ["target"],
                 "radius_m": {"ugv_0": 1.0, "ugv_1": 1.0}, "area_x_m": [0.0, 10.0], "area_y_m": [0.0, 10.0],
                 "game": {"capture_m": capture_m}},
        "media": {"grip": {"kind": "broadcast_radio", "preset": "wifi_broadcast_80211b_1mbps", "decode": "local"}},
        "impairments": list(impairments)}, "Question: who captures?", Path("grip.toml").absolute())
    assert run(scenario, host="inline", out=out, report=False).summary.holds
    return load_run(out).counters


def test_of_two_ugvs_that_grip_at_once_one_captures(tmp_path: Path) -> None:
    counters = gripped(tmp_path / "run")

    assert counters["target"]["captured"] == 1
    assert {name: counters[name] for name in ("ugv_0", "ugv_1")} == {
        "ugv_0": {"held by 0": 1}, "ugv_1": {"held by 0": 1}}     # the first answer keeps the radio busy


def test_a_target_does_not_answer_a_grip_from_beyond_the_capture_distance(tmp_path: Path) -> None:
    counters = gripped(tmp_path / "run", capture_m=1.0)

    assert counters["target"]["captured"] == 0
    assert counters["target"]["grips out of reach"] == 2
    assert counters["ugv_0"] == counters["ugv_1"] == {}


@pytest.mark.parametrize("losses", [0, 1, 2])
def test_an_answer_survives_as_many_losses_in_a_row_as_the_target_is_told(losses: int, tmp_path: Path) -> None:
    lost = [{"on": "grip: target -> *", "kind": "scripted_loss", "lose_frames": list(range(2))}]

    counters = gripped(tmp_path / "run", (2 * S, 4 * S), losses, impairments=lost)

    assert counters["target"]["captured"] == 1
    heard = {"held by 0": 1} if losses == 2 else {}
    assert counters["ugv_0"] == counters["ugv_1"] == heard


def places_of(data: RunData, name: str) -> dict[int, tuple[float, float]]:
    table = data.signals[name]
    columns = [list(table.names).index(axis) for axis in ("x", "y")]
    return {int(at_ns): (float(x), float(y)) for at_ns, (x, y) in zip(
        np.asarray(table.time_ns).tolist(), np.asarray(table.values)[:, columns].tolist(), strict=True)}


@pytest.mark.parametrize("seed", [121, pytest.param(1007, marks=pytest.mark.slow)])
def test_robots_keep_out_of_obstacles_and_sensors_out_of_the_zone(seed: int, tmp_path: Path) -> None:
    data, summary = played(tmp_path / "run", seed, name="marco_polo_zone")

    assert summary.holds
    team: Any = data.scenario["team"]
    obstacles = shapely.union_all([shapely.Polygon(corners).buffer(-1e-6) for corners in team["obstacles"]])
    zone = shapely.Polygon(team["zones"][0]).buffer(-1e-6)
    for name in (*TARGETS, *team["sensors"]):
        half_m = 0.25 if name in team["sensors"] else 0.0
        there = shapely.union_all([shapely.box(x - half_m, y - half_m, x + half_m, y + half_m) if half_m
                                   else shapely.Point(x, y) for x, y in places_of(data, name).values()])
        assert name.startswith("uav") or not there.intersects(obstacles)
        assert name in TARGETS or not there.intersects(zone)
    moved = [name for name in team["sensors"] if len(set(places_of(data, name).values())) > 1]
    assert moved


@pytest.mark.parametrize("real", [True, pytest.param(False, marks=pytest.mark.slow)],
                         ids=["zone without radio", "zone for planners alone"])
def test_nobody_is_heard_from_the_zone_and_two_are_deployed(real: bool, tmp_path: Path) -> None:
    """Without the virtual obstacle, in this game, a sensor drives into the zone after it has won."""
    data, summary = played(tmp_path / "run", 1001, "team.game.zones_are_obstacles=false", "expect={}",
                           *([] if real else ["media.radio.topology.zones=[]"]), name="marco_polo_zone")

    team: Any = data.scenario["team"]
    zone = shapely.Polygon(team["zones"][0])
    places = {name: places_of(data, name) for name in team["sensors"]}
    inside = {(name, at_ns) for name, found in places.items() for at_ns, place in found.items()
              if zone.covers(shapely.Point(place))}
    copies = pq.read_table(tmp_path / "run" / "ledger.parquet").to_pylist()
    ends = [[(copy[end], copy["on_air_ns"] // (100 * MS) * 100 * MS) for end in ("sender", "receiver")]
            for copy in copies if copy["medium"] == "radio" and copy["fate"] == "delivered"]
    assert inside
    assert summary.holds
    assert any(end in inside for pair in ends for end in pair) is not real
    assert (counted(data, "let go") > 0) is real


@pytest.mark.slow
def test_a_sweep_goes_to_and_fro_across_the_way_of_the_target(tmp_path: Path) -> None:
    standing, _ = played(tmp_path / "standing", 1000)
    data, summary = played(tmp_path / "sweeping", 1000, "team.game.sweeps=true")

    assert summary.holds

    def turned(of: RunData) -> int:
        """How often an investigating sensor has turned round, by more than 150 degrees."""
        turns = 0
        for name, table in of.signals.items():
            if not name.startswith("u"):
                continue
            columns = [list(table.names).index(axis) for axis in ("x", "y", "mode")]
            values = np.asarray(table.values)[:, columns]
            steps = np.diff(values[:, :2], axis=0)
            dots = np.sum(steps[1:] * steps[:-1], axis=1)
            lengths = np.hypot(*steps[1:].T) * np.hypot(*steps[:-1].T)
            turns += int(np.sum((dots < -0.866 * lengths) & (lengths > 1e-4) & (values[1:-1, 2] == 1)))
        return turns

    assert turned(data) > turned(standing)


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
    ("team.obstacles=[[[1.0, 1.0], [4.0, 1.0], [4.0, 4.0], [3.0, 2.0]]]",
     "team.obstacles[0]=(1, 1) (4, 1) (4, 4) (3, 2) m: not convex, corner (3, 2) m lies 0.707 m inside the convex "
     "hull; take the hull, (1, 1) (4, 4) (4, 1) m"),
    ("team.zones=[[[1.0, 1.0], [11.0, 1.0], [2.0, 3.0]]]", "team.zones[0]: corner (11, 1) m is outside the area; the "
     "nearest place inside is (10, 1) m"),
    ("team.obstacles=[[[1.0, 1.0], [2.0, 1.0]]]", "expected 3 or more corners"),
    ("team.obstacles=[[1, 2]]", "team.obstacles[0]=[1, 2]: expected a list of corners [x, y], in m"),
    ("team.zones=3", "team.zones=3: expected a list of polygons"),
    ("team.obstacles=[[[4.5, 4.5], [5.5, 4.5], [5.5, 5.5], [4.5, 5.5]]]", "agents.ugv_3=(5, 5) m: its platform of "
     "0.5 m overlaps obstacle 0 by 0.25 m2; the nearest cell that would do is at (4.75, 4.25) m"),
    ("team.zones=[[[2.0, 2.0], [3.5, 2.0], [3.5, 4.0], [2.0, 4.0]]]", "agents.uav_1=(2.5, 2.5) m: its platform of "
     "0.5 m overlaps zone 0 by 0.25 m2; the nearest cell that would do is at (2.25, 1.75) m"),
    ("team.obstacles=[[[0, 9], [1, 9], [1, 9.5], [0, 9.5]], [[1, 9], [1.5, 9], [1.5, 10], [1, 10]]]",
     "team.obstacles: the exit at (0.25, 9.75) m, and 1 more, is out of reach of all UGVs"),
    ("team.obstacles=[[[0, 0], [10, 0], [10, 1]], [[10, 0], [10, 10], [9, 10]], [[0, 0], [0, 10], [0.5, 5]], "
     "[[0, 10], [9.7, 10], [5, 9.8]]]", "leave 1% or more of it free, 0.4 m"),
    ("team.obstacles=[[]]", "team.obstacles[0]=no corners: expected 3 or more corners"),
    ("team.game={detections=8}", "team.game.detections=8: independent detections are of different sensors, and there "
     "are 7; take 7 or less"),
    ("team.game={detections=2.5}", "team.game.detections=2.5: expected a whole number"),
    ("team.game={turn_least_ns=2.5}", "team.game.turn_least_ns=2.5: expected a whole number"),
    ("team.game={cell_m='small'}", "team.game.cell_m=small: expected a number"),
    ("team.game={cell_m=true}", "team.game.cell_m=True: expected a number"),
    ("team.game={sweeps=3}", "team.game.sweeps=3: expected true or false"),
    ("team.game={cell_m=1e-6}", "team.game.cell_m=1e-06: makes 1e+14 cells, and 250000 are the most; take 0.02 m or"),
    ("team.game={investigation=3}", "team.game.investigation=3: expected keys among coverage, detection, distance"),
    ("team.game={investigation={detect=1}}", "team.game.investigation: detect: expected keys among coverage"),
    ("team.game={pursuit={distance=-1}}", "team.game.pursuit: reward weight distance=-1: expected 0 or more"),
    ("team.game={pursuit={distance='far'}}", "team.game.pursuit.distance=far: expected a number"),
    ("team.ugvs=[1, 2]", "team.ugvs=[1, 2]: expected a list of names, each once"),
    ("team.ugvs=[['ugv_1']]", "team.ugvs=[['ugv_1']]: expected a list of names, each once"),
    ("team.sensors=[1, 2]", "team.sensors=[1, 2]: expected 2 to 254 names, each once"),
    ("team.area_x_m='10'", "team.area_x_m=10: expected [from, to], in m"),
    ("team.area_x_m=[[0.0], 10.0]", "team.area_x_m=[[0.0], 10.0]: expected [from, to], in m"),
    ("team.radius_m.uav_1=true", "team.radius_m.uav_1=True: expected a number above 0, in m"),
    ("agents.target_1.plant.parameters.x=5.0", "agents.target_1=(5, 2) m: a target waits where no sensor sees it, more "
     "than 1.5 m outside the area; the nearest place that would do is (5, -1.6) m"),
    ("agents.target_1.parameters.enter_s=0", "(enter_ns=0): expected more than 1000000"),
    ("agents.ugv_1.parameters.slot_ms=4", "agents.ugv_1.parameters.slot_ns=4000000: expected 5000000, as agents.uav_1 "
     "has it: the slots of a team are the same"),
    ("agents.uav_1.parameters.window_ms=100", "the bid window is shorter than its frames"),
])
def test_what_cannot_be_played_is_refused_with_what_would_do(override: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(said)):
        load(find("marco_polo"), overrides=[override])


def test_the_place_that_is_named_for_a_target_and_the_cell_would_do() -> None:
    load(find("marco_polo"), overrides=["agents.target_1.plant.parameters={x=5.0, y=-1.6}", "team.game={detections=7}"])


def test_weights_that_are_not_given_are_the_defaults() -> None:
    team = load(find("marco_polo"), overrides=["team.game={pursuit={distance=2}}"]).team

    assert game_of(team).parameters.pursuit == RewardWeights(detection=0.2, coverage=0.2, distance=2)


@pytest.mark.parametrize(("override", "said"), [
    ("team.zones=[[[5.5, 4.0], [7.5, 4.0], [7.5, 6.5], [5.5, 6.5]]]",
     "media.radio.topology.zones[0] (x 5.5 to 8, y 4 to 6.5 m): protrudes by 0.5 m from team.zones[0], so sensors "
     "drive to where nobody hears them; have one of team.zones cover it, [[5.5, 4], [8, 4], [8, 6.5], [5.5, 6.5]] "
     "would do, or remove team.zones altogether"),
    ("team.zones=[[[5.5, 4.0], [8.0, 4.0], [8.0, 6.5], [5.5, 6.5]], [[0.1, 0.1], [0.8, 0.1], [0.8, 0.8]]]",
     "team.zones[1]=(0.1, 0.1), (0.8, 0.1), (0.8, 0.8) m: meets none of media.radio.topology.zones, so planners avoid "
     "a place where the radio works; give the radio a zone there, remove this one, or remove "
     "media.radio.topology.zones altogether"),
    ("media.radio.topology.zones=[{kind='circle', centre_m=[6.75, 5.0], radius_m=1.5, extra_loss_db=100.0}]",
     "media.radio.topology.zones[0] (x 5.25 to 8.25, y 3.5 to 6.5 m): protrudes by 0.5 m from team.zones[0]"),
])
def test_a_zone_of_planners_or_radio_without_counterpart_is_refused(override: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(said)) as refused:
        load(find("marco_polo_zone"), overrides=[override])

    assert str(refused.value).count("zones[") == said.count("zones[")       # one line of one zone


@pytest.mark.parametrize("override", [
    "team.zones=[]",                                            # either list may be left out
    "media.radio.topology.zones=[]",
    "media.radio.topology={kind='fixed', links=['* -> *']}",
    "team.zones=[[[5.5, 3.9], [8.2, 4.0], [8.0, 7.0], [5.4, 6.5]]]",        # larger than that of the radio
    "media.radio.topology.zones=[{kind='circle', centre_m=[6.75, 5.25], radius_m=1.25, extra_loss_db=100.0}]",
    "media.radio.topology.zones=[{kind='rectangle', low_m=[6, 5], high_m=[7, 6], extra_loss_db=100.0}, "
    "{kind='rectangle', low_m=[11, 5], high_m=[12, 6], extra_loss_db=100.0}]",      # where no sensor drives
])
def test_zones_of_planners_and_radio_that_agree_or_that_are_left_out_are_taken(override: str) -> None:
    load(find("marco_polo_zone"), overrides=[override])


def test_at_the_boundary_of_the_area_a_zone_of_the_radio_may_go_on() -> None:
    corner = "team.zones=[[[9.0, 9.0], [10.0, 9.0], [10.0, 10.0], [9.0, 10.0]]]"
    beyond = "media.radio.topology.zones=[{{kind='rectangle', low_m=[{}, 9], high_m=[99, 99], extra_loss_db=100.0}}]"

    load(find("marco_polo_zone"), overrides=[corner, beyond.format(9.0)])
    with pytest.raises(ScenarioError, match=re.escape("x 8.9 to 10, y 9 to 10 m")):
        load(find("marco_polo_zone"), overrides=[corner, beyond.format(8.9)])
