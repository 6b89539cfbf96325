"""Runs a pursuit scenario with many seeds and counts escapes, for robots with wheels, drives and lossy links.

    python -m benchmarks.pursuit_seeds p3at_chases_p3at 100 "agents.evader.parameters.motion='circle'"

The no-escape theorem holds for pursuers that move freely; the effect of a P3-AT's inertia and turning is measured here,
not proved. A seed changes noise, losses, delays and the random motion of an evader.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from experiments.judge.run_data import load_run
from experiments.run.runner import run
from experiments.scenario import find, load


def main(name: str, seeds: int, *overrides: str) -> None:
    margins, looks, first = [], [], {}
    for seed in range(seeds):
        with TemporaryDirectory() as folder:
            scenario = load(find(name), overrides=[f"seed={seed}", *overrides])
            summary = run(scenario, host="inline", out=Path(folder) / "run", report=False).summary
            counters = load_run(Path(folder) / "run").counters
        standing, = (each for each in summary.guarantees if each.name == "no_escape")
        assert standing.margin is not None
        margins.append(standing.margin)
        looks.append(sum(found.get("looks", 0) for found in counters.values()))
        if standing.first is not None:
            first[seed] = standing.first.from_ns * 1e-9
    print(f"{name} {' '.join(overrides)}: {len(first)} of {seeds} runs with an escape; least distance to the boundary "
          f"{min(margins):.3f} m, median {np.median(margins):.3f} m; looks {np.mean(looks):.1f} "
          f"({min(looks)} to {max(looks)})")
    for seed, at_s in first.items():
        print(f"  seed {seed}: {at_s:.2f} s, by {-margins[seed]:.3f} m")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), *sys.argv[3:])
