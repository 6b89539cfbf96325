"""The firmware of the host runs on the emulated Cortex-M4 too, and at no cost it leaves the same ledger."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import load

ROOT = Path(__file__).parents[3]
ALL = ("r1", "r2", "r3", "r4", "r5")
PROGRAM = 'program = "firmware_sim.drive_controller.drive_controller:DriveController"'
MIXED = ("r1", "r4")


def hash_of(name: str, out: Path, on_chip: tuple[str, ...], duration_s: float, host: HostName = "inline",
            *more: str) -> str:
    overrides = [f"agents.{robot}.{key}" for robot in on_chip
                 for key in ('firmware="synchronizing_robot"', 'target="cortex_m4"', *more)]
    scenario = load(ROOT / f"scenarios/{name}.toml", duration_s=duration_s, overrides=overrides)
    return run(scenario, host=host, out=out, report=False).summary.ledger_hash


@pytest.mark.usefixtures("image")
@pytest.mark.parametrize("name", ["output_sync_reference", "output_sync"])
def test_robots_on_the_chip_leave_the_ledger_of_robots_in_python(name: str, tmp_path: Path):
    python = hash_of(name, tmp_path / "python", (), 0.25)

    assert hash_of(name, tmp_path / "chip", ALL, 0.25) == python
    assert hash_of(name, tmp_path / "mixed", MIXED, 0.25, "process") == python


@pytest.mark.usefixtures("image")
def test_drives_on_the_chip_leave_the_ledger_of_drives_in_python(tmp_path: Path):
    python = (ROOT / "scenarios/tracking_individual.toml").read_text()
    hashes = set()
    for name, agent in (("python", PROGRAM), ("chip", 'firmware = "drive"\ntarget = "cortex_m4"')):
        path = tmp_path / f"{name}.toml"
        path.write_text(python.replace(PROGRAM, agent))
        result = run(load(path, duration_s=0.4), host="inline", out=tmp_path / name, report=False)
        hashes.add(result.summary.ledger_hash)

    assert PROGRAM in python
    assert len(hashes) == 1


def hashes_with_cost(folder: Path, hosts: list[HostName]) -> set[str]:
    """Return the hashes of runs in which computing takes time, on these hosts."""
    return {hash_of("output_sync_reference", folder / str(k), ALL, 0.1, host, "cycles_per_instruction=1.0")
            for k, host in enumerate(hosts)}


@pytest.mark.usefixtures("image")
def test_computing_that_takes_time_gives_one_hash_too(tmp_path: Path):
    hashes = hashes_with_cost(tmp_path, [*["inline"] * 4, "process"])       # processes take seconds to start

    assert len(hashes) == 1
    assert hashes != {hash_of("output_sync_reference", tmp_path / "python", (), 0.1)}


@pytest.mark.slow
@pytest.mark.usefixtures("image")
def test_computing_that_takes_time_gives_one_hash_in_20_runs(tmp_path: Path):
    assert len(hashes_with_cost(tmp_path, ["inline", "process"] * 10)) == 1
