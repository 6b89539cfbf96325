"""The pytest plugin, as installed: pytest in a folder of its own collects scenario files and gives the fixture."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.marconet.test_face import PROGRAM, SCENARIO

TEST = """\
import pytest

def test_one(marconet):
    assert marconet("scenarios/beacons.toml", host="inline", set={"expect": {"count.r2.heard": {"min": 50}}}).holds

@pytest.mark.seeds(4, 5)
def test_seeds(marconet):
    first, second = (marconet("scenarios/beacons.toml", host="inline") for _ in range(2))
    assert first.ledger_hash == second.ledger_hash and "--seed" in first.repeat()
    print("RAN", first.repeat())
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    folder = tmp_path / "scenarios"
    folder.mkdir()
    (folder / "beacon_of_the_face.py").write_text(PROGRAM)
    (folder / "beacons.toml").write_text(SCENARIO)
    (folder / "weak.toml").write_text(SCENARIO.replace("min = 5", "min = 5000"))
    (folder / "wrong.toml").write_text(SCENARIO.replace("seed = 3", "sed = 3"))
    (folder / "broken.toml").write_text("[agents\n")
    (folder / "other.toml").write_text("[tool]\nname = 1\n")
    (tmp_path / "test_it.py").write_text(TEST)
    return tmp_path


def run_pytest(project: Path, *arguments: str) -> str:
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTEST_")}
    done = subprocess.run([sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--marconet-host", "inline", "-rA",
                           *arguments], cwd=project, env=environment, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


@pytest.mark.slow
def test_scenario_files_are_tests_and_a_failure_says_what_where_and_how_to_repeat(project: Path) -> None:
    said = run_pytest(project, "scenarios")

    assert "1 passed" in said
    assert "3 failed" in said
    assert "PASSED scenarios/beacons.toml::beacons" in said
    assert "count.r2.heard is 10: 4990 below the least allowed, 5000" in said
    assert "records: /" in said
    assert f"repeat:  marconet run {project}/scenarios/weak.toml --seed 3 --host inline" in said
    assert 'wrong.toml: sed=3: unknown key; did you mean "seed"?' in said
    assert "broken.toml: line 1" in said
    assert "other.toml" not in said


def test_seeds_of_the_command_line(project: Path) -> None:
    said = run_pytest(project, "scenarios/beacons.toml", "--seeds", "7,8")

    assert "beacons.toml::beacons[seed 7]" in said
    assert "beacons.toml::beacons[seed 8]" in said
    assert "2 passed" in said


@pytest.mark.slow
def test_only_what_is_asked_for_is_collected(project: Path) -> None:
    (project / "pytest.ini").write_text("[pytest]\nmarconet_scenarios = scenarios/beacons.toml\n")

    said = run_pytest(project)

    assert "scenarios/beacons.toml::beacons" in said
    assert "weak" not in said


def test_the_fixture_runs_a_scenario_with_changes_and_seeds(project: Path) -> None:
    said = run_pytest(project, "test_it.py")

    assert "2 passed, 1 failed" in said or "1 failed, 2 passed" in said
    assert "count.r2.heard is 10: 40 below the least allowed, 50" in said
    assert "--seed 4" in said
    assert "--seed 5" in said


def test_seeds_that_are_no_numbers_are_refused(project: Path) -> None:
    assert "'one': expected whole numbers with commas between them, as 1,2,3" in run_pytest(project, "--seeds", "one")


REAL_TIME = """\
import time
import pytest

@pytest.mark.marconet(real_time=True)
def test_paced(marconet):
    began_s = time.monotonic()
    run = marconet("scenarios/beacons.toml", host="inline", length_s=0.3)
    assert time.monotonic() - began_s >= 0.3 and run.repeat().endswith("--real-time")
    virtual = marconet("scenarios/beacons.toml", host="inline", length_s=0.3, real_time=False)
    assert virtual.ledger_hash == run.ledger_hash and "--real-time" not in virtual.repeat()

@pytest.mark.marconet(rate=0.5)
def test_slowly(marconet):
    began_s = time.monotonic()
    assert "real_time.rate=0.5" in marconet("scenarios/beacons.toml", host="inline", length_s=0.2).repeat()
    assert time.monotonic() - began_s >= 0.4

@pytest.mark.marconet(realtime=True)
def test_misspelt(marconet):
    pass
"""


def test_a_marker_lets_the_fixture_run_in_real_time(project: Path) -> None:
    (project / "test_it.py").write_text(REAL_TIME)

    said = run_pytest(project, "test_it.py", "--strict-markers")

    assert "2 passed, 1 error" in said, said
    assert "ValueError: @pytest.mark.marconet: realtime: expected real_time=True, rate=0.5 or both" in said
