"""The synchronizing robot in C sends, bit for bit, what the one in Python sends: one ledger hash, mixed too."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import load
from marconet.running import Run

ROOT = Path(__file__).parents[3]
HASHES: dict[str, str] = tomllib.loads((ROOT / "tests/scenarios/ledger_hashes.toml").read_text())
HALF = ("r2", "r3", "r5")
ALL = ("r1", "r2", "r3", "r4", "r5")


def hash_of(name: str, out: Path, in_c: tuple[str, ...], duration_s: float | None = None,
            host: HostName = "inline") -> str:
    scenario = load(ROOT / f"scenarios/{name}.toml", duration_s=duration_s,
                    overrides=[f'agents.{robot}.firmware="synchronizing_robot"' for robot in in_c])
    assert sorted(robot for robot, agent in scenario.agents.items() if agent.program.startswith("firmware:")) == [*in_c]

    return run(scenario, host=host, out=out, report=False).summary.ledger_hash


@pytest.mark.parametrize("name", ["output_sync_reference", "output_sync"])     # told, and discovered
@pytest.mark.parametrize("in_c", [HALF, ALL], ids=["half", "all"])
def test_robots_in_c_leave_the_ledger_of_robots_in_python(name: str, in_c: tuple[str, ...], tmp_path: Path) -> None:
    python = hash_of(name, tmp_path / "python", (), 1.5)

    assert hash_of(name, tmp_path / "c", in_c, 1.5) == python


def test_robots_in_c_leave_the_same_ledger_from_processes_of_their_own(tmp_path: Path) -> None:
    inline = hash_of("output_sync_reference", tmp_path / "inline", ALL, 0.5)

    assert hash_of("output_sync_reference", tmp_path / "process", HALF, 0.5, host="process") == inline


def test_robots_in_c_record_the_signals_counters_and_events_of_robots_in_python(tmp_path: Path) -> None:
    runs = []
    for in_c in ((), ALL):
        overrides = [f'agents.{robot}.firmware="synchronizing_robot"' for robot in in_c]
        result = run(load(ROOT / "scenarios/output_sync.toml", duration_s=1.0, overrides=overrides), host="inline",
                     out=tmp_path / str(len(in_c)), report=False)
        runs.append(Run(result.folder, result.summary))
    python, c = runs

    assert c.counters == python.counters
    assert c.counters["r1"]["adoptions"] == 2
    assert c.events.drop("wall_clock", strict=False).equals(python.events.drop("wall_clock", strict=False))
    assert list(c.signals) == list(python.signals)
    assert all(c.signals[node].equals(python.signals[node]) for node in python.signals)
    assert {"y", "u"} <= set(c.signals["r1"].columns)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["faults_output_sync", "output_sync", "output_sync_drift", "output_sync_formation",
                                  "output_sync_lossy", "output_sync_reference"])
def test_robots_in_c_leave_the_recorded_ledger_of_the_whole_scenario(name: str, tmp_path: Path) -> None:
    """Faults: a robot killed and restarted, a partition, a clock that jumps by more than six rounds."""
    assert hash_of(name, tmp_path, ALL) == HASHES[name]
