"""The firmware of the host runs on the emulated Cortex-M4 too, and at no cost it leaves the same ledger."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import load
from tests.firmware_sim.firmware.noisy_tracking import NOISE, NOISY, without_expectations

ROOT = Path(__file__).parents[3]
ALL = ("r1", "r2", "r3", "r4", "r5")
TRACKING = ROOT / "scenarios/tracking_individual.toml"
HASHES: dict[str, str] = tomllib.loads((ROOT / "tests/scenarios/ledger_hashes.toml").read_text())
DRIVE = {'program = "firmware_sim.drive_controller.drive_controller:DriveController"': 'firmware = "drive"'}
COMPANION = {'program = "agents.tracking.tracking_robot:TrackingRobot"': 'firmware = "tracking_robot"'}
MIXED = ("r1", "r4")


def hash_of(name: str, out: Path, on_chip: tuple[str, ...], duration_s: float, host: HostName = "inline",
            *more: str) -> str:
    overrides = [f"agents.{robot}.{key}" for robot in on_chip
                 for key in ('firmware="synchronizing_robot"', 'target="cortex_m4"', *more)]
    scenario = load(ROOT / f"scenarios/{name}.toml", duration_s=duration_s, overrides=overrides)
    return run(scenario, host=host, out=out, report=False).summary.ledger_hash


@pytest.mark.usefixtures("image")
@pytest.mark.parametrize("name", [pytest.param("output_sync_reference", marks=pytest.mark.slow), "output_sync"])
def test_robots_on_the_chip_leave_the_ledger_of_robots_in_python(name: str, tmp_path: Path):
    python = hash_of(name, tmp_path / "python", (), 0.25)

    assert hash_of(name, tmp_path / "chip", ALL, 0.25) == python
    assert hash_of(name, tmp_path / "mixed", MIXED, 0.25, "process") == python


def tracking_hash(folder: Path, in_c: dict[str, str], duration_s: float | None = None, more: str = "",
                  noise: str = "") -> str:
    text = TRACKING.read_text() if not noise else without_expectations(TRACKING.read_text()) + NOISY
    for program, firmware in in_c.items():
        assert program in text
        text = text.replace(program, f'{firmware}\ntarget = "cortex_m4"\n{more}')
    folder.mkdir()
    (folder / "noise.py").write_text(noise)
    (folder / "tracking.toml").write_text(text)
    return run(load(folder / "tracking.toml", duration_s=duration_s), host="inline", out=folder / "run",
               report=False).summary.ledger_hash


@pytest.mark.usefixtures("image")
@pytest.mark.parametrize("in_c", [DRIVE, COMPANION, DRIVE | COMPANION], ids=["drive", "companion", "both"])
def test_tracking_on_the_chip_leaves_the_ledger_of_tracking_in_python(in_c: dict[str, str], tmp_path: Path):
    python = tracking_hash(tmp_path / "python", {}, 0.3)

    assert tracking_hash(tmp_path / "chip", in_c, 0.3) == python


@pytest.mark.usefixtures("image")
def test_a_tracking_robot_on_the_chip_does_the_same_with_wrong_frames(tmp_path: Path):
    python = tracking_hash(tmp_path / "python", {}, 0.4, noise=NOISE)

    assert tracking_hash(tmp_path / "chip", COMPANION, 0.4, noise=NOISE) == python


@pytest.mark.usefixtures("image")
def test_a_trigger_whose_computing_takes_time_gives_one_hash_too(tmp_path: Path):
    cost = "cycles_per_instruction = 1.0"
    hashes = {tracking_hash(tmp_path / str(k), COMPANION, 0.1, cost) for k in range(2)}

    assert len(hashes) == 1
    assert hashes != {tracking_hash(tmp_path / "python", {}, 0.1)}


@pytest.mark.slow
@pytest.mark.usefixtures("image")
@pytest.mark.parametrize("in_c", [DRIVE, DRIVE | COMPANION], ids=["drive", "both"])
def test_tracking_on_the_chip_leaves_the_recorded_ledger_of_the_whole_scenario(in_c: dict[str, str], tmp_path: Path):
    assert tracking_hash(tmp_path / "chip", in_c) == HASHES["tracking_individual"]


def hashes_with_cost(folder: Path, hosts: list[HostName]) -> set[str]:
    """Return the hashes of runs in which computing takes time, on these hosts."""
    return {hash_of("output_sync_reference", folder / str(k), ALL, 0.1, host, "cycles_per_instruction=1.0")
            for k, host in enumerate(hosts)}


@pytest.mark.usefixtures("image")
def test_computing_that_takes_time_gives_one_hash_too(tmp_path: Path):
    hashes = hashes_with_cost(tmp_path, ["inline", "inline", "process"])       # processes take seconds to start

    assert len(hashes) == 1
    assert hashes != {hash_of("output_sync_reference", tmp_path / "python", (), 0.1)}


@pytest.mark.slow
@pytest.mark.usefixtures("image")
def test_computing_that_takes_time_gives_one_hash_in_20_runs(tmp_path: Path):
    assert len(hashes_with_cost(tmp_path, ["inline", "process"] * 10)) == 1
