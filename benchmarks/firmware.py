"""Measures robots in C beside robots in Python, as ratios: output_sync and output_sync_reference, inline.

    python -m benchmarks.firmware [PAIRS [SECONDS]]

A pair is Python, C, C, Python: its ratio is that of the processor times of the emulator's process from the first grant
to the finished ledger, more than 1 if the robots in C are faster. Told are the median and all of the pairs, as the
machine may change its speed within seconds. Only pairs of one kind of code (`marconet compile`) can be compared.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from statistics import median

from experiments import CODE
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


def main(pairs: int, duration_s: float) -> None:
    for name in ("output_sync", "output_sync_reference"):
        ratios: list[float] = []
        hashes: set[str] = set()
        for _ in range(pairs):
            found = [once(name, overrides, duration_s) for overrides in ([], IN_C, IN_C, [])]
            (first_s, *c_s, last_s), ledgers = zip(*found, strict=True)
            ratios.append((first_s + last_s) / sum(c_s))
            hashes.update(ledgers)
        print(f"{name}, {duration_s:g} s, {CODE.partition(':')[0]}: ratio {median(ratios):.2f} in the median, pairs "
              f"{', '.join(f'{ratio:.2f}' for ratio in sorted(ratios))}, {len(hashes)} ledger hash")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 8, float(sys.argv[2]) if len(sys.argv) > 2 else 2.0)
