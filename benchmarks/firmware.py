"""Measures robots in C beside robots in Python, as ratios: output_sync and output_sync_reference, inline.

    python -m benchmarks.firmware [RUNS [SECONDS]]

The two alternate. The ratio is that of the least processor times of the emulator's process from the first grant to the
finished ledger, more than 1 if the robots in C are faster; a run that is disturbed takes longer, never less.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from experiments.run.runner import run
from experiments.scenario import load

SCENARIOS = Path(__file__).parents[1] / "scenarios"
IN_C = [f'agents.r{number}.firmware="synchronizing_robot"' for number in range(1, 6)]


def once(name: str, overrides: list[str], duration_s: float) -> tuple[float, str]:
    """Return processor seconds and ledger hash of a run."""
    scenario = load(SCENARIOS / f"{name}.toml", duration_s=duration_s, overrides=overrides)
    with tempfile.TemporaryDirectory() as folder:
        summary = run(scenario, host="inline", out=Path(folder) / "run", report=False).summary
    return summary.processor_s, summary.ledger_hash


def main(runs: int, duration_s: float) -> None:
    for name in ("output_sync", "output_sync_reference"):
        found: dict[str, list[tuple[float, str]]] = {"Python": [], "C": []}
        for _ in range(runs):
            for language, overrides in (("Python", []), ("C", IN_C)):
                found[language].append(once(name, overrides, duration_s))
        python_s, c_s = (min(processor_s for processor_s, _ in found[language]) for language in ("Python", "C"))
        hashes = {ledger for times in found.values() for _, ledger in times}
        print(f"{name}, {duration_s:g} s, {runs} runs each: Python {python_s:.3f} s, C {c_s:.3f} s of processor time, "
              f"ratio {python_s / c_s:.2f}, {len(hashes)} ledger hash")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10, float(sys.argv[2]) if len(sys.argv) > 2 else 2.0)
