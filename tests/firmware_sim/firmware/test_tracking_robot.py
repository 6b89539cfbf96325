"""The tracking robot in C sends, bit for bit, what the one in Python sends, whatever arrives on radio and bus."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from agents.tracking.tracking_robot import COUNTERS
from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import load
from experiments.scenario.problems import ScenarioError
from marconet.running import Run
from tests.firmware_sim.firmware.noisy_tracking import NOISE, NOISY, without_expectations

ROOT = Path(__file__).parents[3]
HASHES: dict[str, str] = tomllib.loads((ROOT / "tests/scenarios/ledger_hashes.toml").read_text())
COMPANION = 'program = "agents.tracking.tracking_robot:TrackingRobot"', 'firmware = "tracking_robot"'
DRIVE = 'program = "firmware_sim.drive_controller.drive_controller:DriveController"', 'firmware = "drive"'
POLICY = 'policy = "individual_gains"'
UNIFIED, PERIODIC = 'policy = "unified_gain"', 'policy = "periodic", certified_radius = 4.0'
WHOLE = ["faults_tracking", "tracking_busload", "tracking_individual", "tracking_lossy", "tracking_unified"]


def tracked(text: str, folder: Path, *, in_c: tuple[tuple[str, str], ...] = (), target: str = "host",
            duration_s: float | None = None, host: HostName = "inline") -> Run:
    for program, firmware in in_c:
        assert program in text
        text = text.replace(program, f'{firmware}\ntarget = "{target}"')
    folder.mkdir(exist_ok=True)
    path = folder / f"{target}{len(in_c)}.toml"
    path.write_text(text)
    result = run(load(path, duration_s=duration_s), host=host, out=folder / path.stem, report=False)
    return Run(result.folder, result.summary)


def scenario(name: str) -> str:
    return (ROOT / f"scenarios/{name}.toml").read_text()


@pytest.mark.parametrize(("policy", "duration_s"), [(POLICY, 2.4), (UNIFIED, 0.5), (PERIODIC, 0.5)],
                         ids=["individual", "unified", "periodic"])
def test_a_robot_in_c_leaves_the_ledger_of_one_in_python(policy: str, duration_s: float, tmp_path: Path) -> None:
    text = scenario("tracking_individual").replace(POLICY, policy)

    python = tracked(text, tmp_path, duration_s=duration_s)
    c = tracked(text, tmp_path, in_c=(COMPANION, DRIVE), duration_s=duration_s)

    assert c.ledger_hash == python.ledger_hash
    assert c.counters == python.counters
    assert c.counters["companion"]["measurements"] > 50


def test_a_robot_in_c_does_the_same_with_wrong_frames_lost_answers_and_a_clock_that_steps(tmp_path: Path) -> None:
    text = without_expectations(scenario("tracking_individual")) + NOISY
    (tmp_path / "noise.py").write_text(NOISE)

    python = tracked(text, tmp_path, duration_s=0.8)
    c = tracked(text, tmp_path, in_c=(COMPANION,), duration_s=0.8)

    assert c.ledger_hash == python.ledger_hash
    assert c.counters == python.counters
    assert c.events.drop("wall_clock", strict=False).equals(python.events.drop("wall_clock", strict=False))
    signals = ["held1", "held2", "held3", "tau"]
    assert c.signals["companion"].select(signals).equals(python.signals["companion"].select(signals))
    assert [name for name in COUNTERS if not python.counters["companion"][name]] == []


def test_a_robot_in_c_leaves_the_same_ledger_from_a_process_of_its_own(tmp_path: Path) -> None:
    inline = tracked(scenario("tracking_individual"), tmp_path / "inline", duration_s=0.2)

    process = tracked(scenario("tracking_individual"), tmp_path / "process", in_c=(COMPANION, DRIVE), duration_s=0.2,
                      host="process")

    assert process.ledger_hash == inline.ledger_hash


def test_a_wrong_policy_and_a_start_of_two_numbers_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "wrong.toml"
    text = scenario("tracking_individual").replace(*COMPANION)

    path.write_text(text.replace(POLICY, 'policy = "event_triggered"'))
    with pytest.raises(ScenarioError) as policy:
        load(path)
    path.write_text(text.replace(POLICY, "start = [0.0, 1.0]"))
    with pytest.raises(ScenarioError) as start:
        load(path)

    assert "agents.companion.parameters.policy" in str(policy.value)
    assert "agents.companion.parameters.start: 2 numbers: expected x, y and heading" in str(start.value)


@pytest.mark.slow
@pytest.mark.parametrize("in_c", [(COMPANION,), (COMPANION, DRIVE)], ids=["companion", "both"])
@pytest.mark.parametrize("name", WHOLE)
def test_a_robot_in_c_leaves_the_recorded_ledger_of_the_whole_scenario(
        name: str, in_c: tuple[tuple[str, str], ...], tmp_path: Path) -> None:
    assert tracked(scenario(name), tmp_path, in_c=in_c).ledger_hash == HASHES[name]
