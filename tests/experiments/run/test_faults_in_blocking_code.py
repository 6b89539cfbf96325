"""Faults of robots whose program is ordinary blocking code, in a process of its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.run.runner import run
from experiments.scenario import load
from netem.records.ledger_file import read_ledger
from tests.experiments.run.fault_bench import PROGRAM, SCENARIO

BLOCKING = '''
import time

from firmware_sim.blocking.here import this_program


def main():
    port = this_program().board.port("radio")
    print(f"begins at {time.monotonic():.3f}", flush=True)
    try:
        while True:
            time.sleep(0.1)
            port.send(b"here")
    finally:
        print("cleans up", flush=True)
'''


def instants_s(folder: Path, faults: str) -> list[float]:
    """Run the scenario, in which `b` is blocking code, with these faults; return the instants at which `b` sent [s]."""
    (folder / "blocking.py").write_text(BLOCKING)
    (folder / "beacon.py").write_text(PROGRAM)
    robots = SCENARIO.replace('b = { parameters = { offset_ms = 3, v = 0.5 }, plant = { fmu = "unicycle" } }',
                              'b = { program = "blocking:main" }')
    assert "blocking:main" in robots
    (folder / "faults.toml").write_text(robots + faults)
    run(load(folder / "faults.toml"), host="process", out=folder / "run", report=False)
    rows = read_ledger(folder / "run" / "ledger.parquet").to_pylist()
    return sorted({row["offered_ns"] / 1e9 for row in rows if row["sender"] == "b"})


@pytest.mark.parametrize(("fault", "sent_s"), [
    ('kind = "kill"\nat_s = 0.35\nrestart_after_s = 0.3', [0.1, 0.2, 0.3, 0.75, 0.85, 0.95]),
    ('kind = "pause"\nduring_s = [0.35, 0.62]', [0.1, 0.2, 0.3, 0.62, 0.72, 0.82, 0.92]),
    ('kind = "clock_step"\nat_s = 0.35\nby_ms = 40', [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]),
    # a wait of 100 ms that is under way ends when it was going to, later ones take 100 / 1.25 ms
    ('kind = "clock_drift"\nduring_s = [0.35, 1.0]\nby_ppm = 250_000', [0.1, 0.2, 0.3, 0.4, 0.48, 0.56, 0.64, 0.72, 0.8,
                                                                       0.88, 0.96])])
def test_faults_reach_blocking_code(tmp_path: Path, fault: str, sent_s: list[float]) -> None:
    assert instants_s(tmp_path, f'[[faults]]\non = "b"\n{fault}\n') == pytest.approx(sent_s, abs=1e-6)

    log = (tmp_path / "run" / "logs" / "b.log").read_text().splitlines()
    # a kill runs no `finally`; the second life measures durations from the start of the run, as its robot's oscillator
    again = ["begins at 0.650"] if "kill" in fault else []
    assert log == ["begins at 0.000", *again, "cleans up"]


def test_blocking_code_boots_on_an_oscillator_that_a_fault_has_changed(tmp_path: Path) -> None:
    sent_s = instants_s(tmp_path, '[[faults]]\non = "b"\nkind = "clock_drift"\nat_s = 0.2\nby_ppm = 250_000\n'
                                  '[[faults]]\non = "b"\nkind = "kill"\nat_s = 0.3\nrestart_after_s = 0.2\n')

    assert sent_s[-6:] == pytest.approx([0.5 + 0.08 * k for k in range(1, 7)], abs=1e-6)
    assert sent_s[-7] < 0.3
