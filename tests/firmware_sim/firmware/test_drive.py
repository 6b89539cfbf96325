"""The drive controller in C sends, bit for bit, what the one in Python sends, whatever arrives on its bus."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from experiments.run.runner import run
from experiments.scenario import load

ROOT = Path(__file__).parents[3]
HASHES: dict[str, str] = tomllib.loads((ROOT / "tests/scenarios/ledger_hashes.toml").read_text())
PROGRAM = 'program = "firmware_sim.drive_controller.drive_controller:DriveController"'

NOISE = '''
from netem.media.can.frame import CanFrame, pack


class Noise:
    """Sends setpoints, most of them right, between frames that are wrong in every way that a bus carries."""

    def __init__(self, board):
        self.board, self.port, self.sent = board, board.port("can"), 0
        board.every(3_000_000, self.send)

    def send(self):
        rng = self.board.rng
        self.sent += 1
        identifier = rng.choice([0x110, 0x110, 0x110, 0x111, 0x7FF])
        length = rng.choice([8, 8, 8, 8, 7, 0])
        data = bytearray(rng.randbytes(length))
        if length == 8 and rng.random() < 0.8:
            data[2], data[5], data[6] = rng.choice([0, 1, 255]), rng.choice([0, 1, 255, 128]), rng.choice([0, 1, 1, 2])
        remote = rng.random() < 0.1
        self.port.send(pack(CanFrame(identifier, b"" if remote else bytes(data), extended=rng.random() < 0.1,
                                     remote=remote)))
'''
SCENARIO = '''
seed = 3
length_s = 3.0

[agents.noise]
program = "noise:Noise"

[agents.drive]
program = "firmware_sim.drive_controller.drive_controller:DriveController"
plant = { fmu = "unicycle" }
clock = { offset_ms = 2.7, drift_ppm = 80.0, tick_us = 1 }

[agents.drive.parameters]
period_ms = 2
odometry_every = 3
stale_after_ms = 20
ramp_radps2 = 300.0
command_max_radps = 30.0

[media.can]
kind = "can"
bit_rate_bps = 500_000

[[faults]]
kind = "clock_step"
name = "back"
on = "drive"
at_s = 1.0
by_ms = -7.3

[[faults]]
kind = "clock_step"
name = "forward"
on = "drive"
at_s = 2.0
by_ms = 11.1
'''


def ledger_and_counters(scenario: str, folder: Path, in_c: bool,
                        duration_s: float | None = None) -> tuple[str, dict[str, int]]:
    assert PROGRAM in scenario
    path = folder / f"{'c' if in_c else 'python'}.toml"
    path.write_text(scenario.replace(PROGRAM, 'firmware = "drive"') if in_c else scenario)
    result = run(load(path, duration_s=duration_s), host="inline", out=folder / path.stem, report=False)
    counters: dict[str, int] = json.loads((result.folder / "run.json").read_text())["counters"]["drive"]
    return result.summary.ledger_hash, counters


def test_a_drive_in_c_leaves_the_ledger_of_one_in_python(tmp_path: Path) -> None:
    scenario = (ROOT / "scenarios/tracking_individual.toml").read_text()

    python = ledger_and_counters(scenario, tmp_path, False, 1.5)

    assert ledger_and_counters(scenario, tmp_path, True, 1.5) == python


def test_a_drive_in_c_does_the_same_with_wrong_frames_and_a_clock_that_steps(tmp_path: Path) -> None:
    (tmp_path / "noise.py").write_text(NOISE)

    python = ledger_and_counters(SCENARIO, tmp_path, False)

    assert ledger_and_counters(SCENARIO, tmp_path, True) == python
    assert all(python[1][name] > 0 for name in ("setpoints refused", "setpoints taken", "releases missed"))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["faults_tracking", "tracking_busload", "tracking_individual", "tracking_lossy"])
def test_a_drive_in_c_leaves_the_recorded_ledger_of_the_whole_scenario(name: str, tmp_path: Path) -> None:
    scenario = (ROOT / f"scenarios/{name}.toml").read_text()

    assert ledger_and_counters(scenario, tmp_path, True)[0] == HASHES[name]
