"""At the lower bounds that pyproject.toml declares, three scenarios run and leave the known ledgers."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
HASHES: dict[str, str] = tomllib.loads((TOP / "tests" / "scenarios" / "ledger_hashes.toml").read_text())
SCENARIOS = ("output_sync", "tracking_individual", "hummingbird_chases_rovio")     # radio; CAN with a DBC; MAVLink


@pytest.fixture(scope="module")
def marconet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    uv = pytest.importorskip("uv", reason="needs uv: pip install -e '.[dev]'").find_uv_bin()
    folder = tmp_path_factory.mktemp("lowest")
    subprocess.run([uv, "venv", "--quiet", "--python", sys.executable, folder / "venv"], check=True)
    subprocess.run([uv, "pip", "install", "--quiet", "--python", folder / "venv" / "bin" / "python",
                    "--resolution", "lowest-direct", TOP], cwd=TOP, check=True)
    return Path(folder / "venv" / "bin" / "marconet")


@pytest.mark.slow
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_scenario_runs_and_leaves_the_recorded_ledger(scenario: str, marconet: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"

    done = subprocess.run([marconet, "run", scenario, "--out", out], cwd=tmp_path, capture_output=True, text=True,
                          timeout=300, check=False)

    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads((out / "summary.json").read_text())["ledger_hash"] == HASHES[scenario]
