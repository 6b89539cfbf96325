"""Robots that pursue, as programs in emulated runs: when they look, what both hosts agree on, what is refused."""

from __future__ import annotations

from itertools import pairwise
from math import ceil
from pathlib import Path

import pytest

from experiments.judge.frame_copies import FrameCopies
from experiments.judge.run_data import RunData, load_run
from experiments.run.runner import run
from experiments.scenario import ScenarioError, find, load

STEP_NS = 70_000_000
MS = 1_000_000
QUIET = ("impairments=[]", "media.view.noise_m=0.0", "agents.pursuer.parameters.execution_ms=2")


def ran(name: str, out: Path, *overrides: str, length_s: float) -> RunData:
    scenario = load(find(name), duration_s=length_s, overrides=overrides)
    run(scenario, host="inline", out=out, report=False)
    return load_run(out)


def looks(data: RunData, medium: str = "view") -> FrameCopies:
    found = data.ledger.only(medium=medium)
    return found.taken(found.ints("offered_ns").argsort(kind="stable"))


def standing(out: Path, *overrides: str, length_s: float = 12.0) -> RunData:
    """An evader that stands 0.5 m aside, in the no-moving area: nobody moves."""
    return ran("p3at_chases_p3at", out, *QUIET, *overrides, "agents.evader.parameters.v_max_mps=1e-9",
               "agents.evader.plant.parameters.x=0.5", length_s=length_s)


def test_after_the_first_looks_it_looks_when_a_target_of_full_speed_could_be_near_the_edge(tmp_path: Path) -> None:
    data = standing(tmp_path / "run")

    seen = looks(data).ints("offered_ns").tolist()
    doubt_s = (3.0 - 1.5 - 0.5) / 0.35                   # R - zeta - |y - q|, at v_max
    steps = ceil(doubt_s * 1e9 / STEP_NS) + 1           # tested at the instant at or after it, looked one later
    assert seen[:3] == [STEP_NS, 2 * STEP_NS, 3 * STEP_NS]
    assert {later - one for one, later in pairwise(seen[2:])} == {steps * STEP_NS}


def test_a_look_that_is_not_answered_is_repeated_when_the_latency_is_over(tmp_path: Path) -> None:
    data = standing(tmp_path / "run", "impairments=[{on='view: evader -> pursuer', kind='scripted_loss', "
                    "lose_frames=[3, 4, 5]}]")

    found = looks(data)
    lost = found.only(fate="lost").ints("offered_ns").tolist()
    later = [min(at for at in found.ints("offered_ns").tolist() if at > one) for one in lost]
    assert len(lost) == 3
    assert {b - a for a, b in zip(lost, later, strict=True)} == {4 * STEP_NS}       # 210 ms are three steps


def test_it_drives_towards_a_target_that_is_out_of_the_no_moving_area(tmp_path: Path) -> None:
    data = ran("p3at_chases_p3at", tmp_path / "run", *QUIET, "agents.evader.parameters.v_max_mps=1e-9",
               "agents.evader.plant.parameters.x=2.0", length_s=20.0)

    table = data.signals["drive"]
    assert table.column("x")[-1] == pytest.approx(2.0, abs=0.61)        # up to where the next look found it inside
    assert table.column("x")[-1] > 1.0
    assert abs(table.column("y")).max() < 0.02


def test_estimates_and_detections_are_where_the_target_is(tmp_path: Path) -> None:
    data = standing(tmp_path / "run")

    table = data.signals["pursuer"]
    after = table.time_ns > 4 * STEP_NS + 30 * MS
    for name, where in (("estimate_x", 0.5), ("estimate_y", 0.0), ("detection_x", 0.5), ("detection_y", 0.0)):
        assert table.column(name)[after] == pytest.approx(where, abs=1e-6)


@pytest.mark.parametrize(("name", "length_s"), [
    ("p3at_chases_p3at", 6.0), *(pytest.param(*case, marks=pytest.mark.slow) for case in (
        ("two_p3at_chase_rovio", 4.0), ("four_sensors_two_targets", 2.0)))])
def test_both_hosts_leave_one_ledger(tmp_path: Path, name: str, length_s: float) -> None:
    hashes = {run(load(find(name), duration_s=length_s), host=host, out=tmp_path / host,
                  report=False).summary.ledger_hash for host in ("inline", "process")}

    assert len(hashes) == 1


def test_a_runner_escapes_from_a_pursuer_that_is_blind_and_the_cause_says_so(tmp_path: Path) -> None:
    data = ran("p3at_chases_p3at", tmp_path / "run", "impairments[1].kind='bernoulli_loss'",
               "impairments[1]={on='view: evader -> pursuer', kind='bernoulli_loss', loss_ratio=1.0, "
               "during_s=[1.0, 20.0]}", "agents.evader.parameters.motion='circle'", length_s=20.0)

    violation, = data.guarantees["no_escape"].violations
    assert violation.from_ns < 15_000 * MS              # about 3 m at 0.275 m/s
    assert "lost (impairments[1] bernoulli_loss)" in violation.cause


def test_whom_a_sensor_claims_it_is_in_charge_of_and_idle_ones_stand(tmp_path: Path) -> None:
    data = ran("four_sensors_two_targets", tmp_path / "run", "impairments=[]", length_s=3.0)

    told = {(event.node, event.detail) for event in data.events if event.kind == "in charge" and event.node != "center"}
    assert told == {("sensor_a", "target_1"), ("sensor_d", "target_2")}
    for drive in ("drive_b", "drive_c"):
        assert data.signals[drive].column("v").max() == 0.0


@pytest.mark.parametrize(("name", "override", "says"), [
    ("p3at_chases_p3at", "agents.pursuer.parameters.escape_m=0.4", "escape_m=0.4: a target of 0.35 m/s, seen"),
    ("p3at_chases_p3at", "agents.pursuer.parameters.radius_m=2.9", "radius_m=2.9: media.view has range_m=3.0; take"),
    ("p3at_chases_p3at", "media.view.exposure_period_ms=35", "step_ns=70000000: media.view has exposures every 350000"),
    ("p3at_chases_p3at", "media.view.noise_m=0.2", "sigma_m=0.1: media.view has noise_m=0.2; take that much or more"),
    ("p3at_chases_p3at", "media.view.latency_ms=300", "latency_ns=210000000: the news of media.view take 300000000 ns"),
    ("p3at_chases_p3at", "agents.pursuer.parameters.execution_ms=80", "execution_ms=80 (execution_ns=80000000): expe"),
    ("p3at_chases_p3at", "agents.pursuer.media=['view']", "agents.pursuer.media: lacks can"),
    ("p3at_chases_p3at", "agents.evader.parameters.motion='zigzag'", 'motion="zigzag": expected one of circle'),
    ("p3at_chases_p3at", "agents.evader.parameters.motion='runner'", "agents.evader.media: a runner sees its pursuer"),
    ("p3at_chases_p3at", "team.robot={}", "team.robot: is missing wheel_radius_m, track_m, counts_per_turn"),
    ("two_p3at_chase_rovio", "team.sensors=['pursuer_fast']", "pursuer_slow is missing; frames number the sensors by"),
    ("two_p3at_chase_rovio", "team.targets=[]", "team.targets=[]: expected 1 to 254 names, each once"),
])
def test_what_cannot_work_is_refused_before_the_start(name: str, override: str, says: str) -> None:
    with pytest.raises(ScenarioError) as error:
        load(find(name), overrides=[override])

    assert says in str(error.value)
