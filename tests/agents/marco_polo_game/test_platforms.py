"""The scenario marco_polo_platforms: UGVs behind drive controllers on CAN, a UAV behind an autopilot on MAVLink."""

from __future__ import annotations

import re
from itertools import pairwise
from math import hypot
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.judge.run_data import RunData
from experiments.scenario import ScenarioError, find, load
from netem.records.event_fields import read
from tests.agents.marco_polo_game.games import played as play

S = 1_000_000_000
SCENARIO = "marco_polo_platforms"
SEED = 1006                     # a game with two captures and two pursuits
LATER_S = 6.0                   # targets enter so much later than in marco_polo
UGVS = {f"ugv_{number}": f"drive_{number}" for number in range(1, 6)}


@pytest.fixture(scope="module")
def game(tmp_path_factory: pytest.TempPathFactory) -> tuple[RunData, Any]:
    return played(tmp_path_factory.mktemp("platforms") / "run", SCENARIO)


def played(out: Path, name: str, *overrides: str, host: Any = "inline") -> tuple[RunData, Any]:
    return play(out, name, *overrides, seed=SEED, host=host)


def columns(data: RunData, node: str, *names: str) -> dict[int, list[float]]:
    """Return the values of some signals of a node, by time in ns."""
    table = data.signals[node]
    found = np.asarray(table.values)[:, [list(table.names).index(name) for name in names]]
    return dict(zip(np.asarray(table.time_ns).tolist(), found.tolist(), strict=True))


@pytest.mark.slow
def test_both_hosts_have_one_ledger(tmp_path: Path) -> None:
    short = ("length_s=8.0", "expect={}", "node_timeout_s=150.0")

    _, inline = played(tmp_path / "inline", SCENARIO, *short)
    _, process = played(tmp_path / "process", SCENARIO, *short, host="process")

    assert inline.ledger_hash == process.ledger_hash


@pytest.mark.slow
def test_a_seed_has_the_targets_of_the_game_without_inertia(game: tuple[RunData, Any], tmp_path: Path) -> None:
    plain, _ = played(tmp_path / "plain", "marco_polo")

    for target in ("target_1", "target_2", "target_3"):
        entered, turned = ([event for event in data.events if event.node == target and event.kind == "mode"
                            and ("-> inside" in event.detail)] for data in (plain, game[0]))
        both = list(zip(entered, turned, strict=False))
        assert both
        assert {round((later.time_ns - early.time_ns) * 1e-9, 6) for early, later in both} == {LATER_S}
        assert [early.detail.partition(": enters")[2] for early, _ in both] == [
            later.detail.partition(": enters")[2] for _, later in both]


@pytest.mark.slow
def test_every_claim_of_the_automata_holds_and_targets_are_captured_by_ugvs(game: tuple[RunData, Any]) -> None:
    data, summary = game

    assert summary.holds                            # with guarantee.executions.violations = 0
    captures = [(event.node, event.time_ns, (read(event.detail) or {})["target"])
                for event in data.events if event.kind == "capture"]
    assert len(captures) == 2
    for node, time_ns, target in captures:
        before_ns = time_ns // 100_000_000 * 100_000_000 - 100_000_000
        own, other = columns(data, UGVS[node], "x", "y")[before_ns], columns(data, target, "x", "y")[before_ns]
        # capture_m, and what both drive between the sample before and the capture: 0.2 s at 1.2 and 0.7 m/s
        assert hypot(own[0] - other[0], own[1] - other[1]) <= 0.5 + 0.2 * (1.2 + 0.7)


@pytest.mark.slow
def test_sensors_know_their_places_and_a_waiting_one_comes_to_rest(game: tuple[RunData, Any]) -> None:
    data, _ = game

    moved = 0
    for ugv, drive in UGVS.items():
        told, true = columns(data, ugv, "x", "y", "mode"), columns(data, drive, "x", "y", "v")
        assert max(hypot(told[at][0] - true[at][0], told[at][1] - true[at][1]) for at in told) < 0.02
        moved += any(abs(v) > 0.3 for _, _, v in true.values())
        # 1.2 m/s at 0.29 m/s2, and a delay of 0.3 s: after that it stands, but for a count of an encoder
        waits_ns = 0
        for before_ns, at_ns in pairwise(sorted(told)):
            waits_ns = waits_ns + at_ns - before_ns if told[at_ns][2] == 0 else 0
            if waits_ns > (1.2 / 0.29 + 0.3) * S:
                assert abs(true[at_ns][2]) < 1e-3
    assert moved >= 2


@pytest.mark.parametrize(("override", "said"), [
    ("agents.drive_1.plant={fmu='omnidirectional', parameters={x=2.5, y=7.5}}",
     "agents.drive_1.plant.fmu='omnidirectional': has no u_left, u_right, angle_left, angle_right, by which this "
     "platform is moved; take 'unicycle'"),
    ("agents.uav_2.plant={fmu='unicycle', parameters={x=7.5, y=7.5}}",
     "agents.uav_2.plant.fmu='unicycle': has no v_x_cmd, v_y_cmd, by which this platform is moved"),
    ("agents.ugv_1.media=['radio', 'view_ugv', 'grip']", "agents.ugv_1.parameters.drive.can='can_1': no such port"),
    ("agents.uav_1.parameters.flight.link='line'", "agents.uav_1.parameters.flight.link='line': no such port"),
    ("media.view_ugv.cameras.ugv_1='drive_2'", "the camera of ugv_1 is on drive_2; it rides on the platform that ugv_1 "
     "drives: write ugv_1 = the drive controller on can_1"),
    ("media.view_uav.cameras={}", "the camera of uav_1 is on no body; it rides on the vehicle that uav_1 flies"),
    ("agents.ugv_1.parameters.drive.start=[2.5, 7.0, 0.0]",
     "agents.ugv_1.parameters.drive.start: y=7, and agents.drive_1.plant has y=7.5; write the same in both"),
    ("team.robot.track_m=0.4", "team.robot: track_m=0.4, and agents.drive_1.plant has track_m=0.573"),
    ("team.game={ugv_mps=1.5}", "team.game.ugv_mps=1.5: the wheels of agents.drive_1.plant reach speed_max_mps=1.2"),
    ("agents.ugv_1.parameters.drive.wheel_mps2=0.4", "wheel_mps2=0.4: the wheels of agents.drive_1.plant reach "
     "accel_max_mps2=0.3; take that or less, or faster wheels"),
    ("agents.ugv_1.parameters.drive.accel_mps2=0.29", "to turn with while the platform brakes; take less, as 0.193"),
    ("agents.ugv_1.plant={fmu='unicycle', parameters={x=2.5, y=7.5}}",
     "agents.ugv_1.plant: this sensor has a plant and drives another one"),
    ("team.robot={}", "team.robot: is missing wheel_radius_m, track_m, counts_per_turn"),
    ("agents.ugv_1.parameters.flight={link='can_1', start=[2.5, 7.5, 0.0]}", "a sensor has one platform"),
    ("team.obstacles=[[[4.0, 3.0], [6.0, 3.0], [6.0, 4.0], [4.0, 4.0]]]", "does not keep clear of team.obstacles"),
])
def test_a_platform_that_cannot_be_moved_is_refused_with_what_would_do(override: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(said)):
        load(find(SCENARIO), overrides=[override])
