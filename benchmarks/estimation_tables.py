"""Tables 3.1 to 3.4, the columns of the Kalman and the particle filter: printed, ours, tolerance; and time per step.

    python -m benchmarks.estimation_tables [--runs 100]

Time per step: a prediction to the next instant and a correction with a detection, as at 786 detections; median of 7
rounds. Exits with 1 if a cell that is to be met is not.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from time import perf_counter

import numpy as np

from agents.estimation import Inputs
from agents.estimation.monte_carlo import FILTERS, errors_m
from agents.estimation.paths import PATHS, STEP_NS

# path, detections, filter: printed, expected, tolerance [m]
CELLS = {
    ("circle", 786, "UKF"): (0.0960, 0.0956, 0.002), ("circle", 786, "PF"): (0.0954, 0.0956, 0.002),
    ("circle", 100, "UKF"): (0.1060, 0.109, 0.006), ("circle", 100, "PF"): (0.1407, 0.140, 0.006),
    ("circle", 31, "UKF"): (0.1480, 0.143, 0.02), ("circle", 31, "PF"): (0.2084, 0.193, 0.02),
    ("circle", 22, "UKF"): (0.2080, 0.174, 0.03), ("circle", 22, "PF"): (0.2571, 0.241, 0.02),
    ("circle", 17, "UKF"): (0.4623, 0.222, 0.05), ("circle", 17, "PF"): (0.3352, 0.304, 0.03),
    ("zig-zag", 786, "UKF"): (0.0966, 0.0957, 0.002), ("zig-zag", 786, "PF"): (0.0959, 0.0956, 0.002),
    ("zig-zag", 100, "UKF"): (0.1170, 0.129, 0.01), ("zig-zag", 100, "PF"): (0.1425, 0.148, 0.01),
    ("zig-zag", 25, "UKF"): (1.073, 1.086, 0.05), ("zig-zag", 25, "PF"): (0.836, 0.835, 0.05),
}
GOAL_US = {"UKF": 30.0, "PF": 90.0}


def step_us(name: str, steps: int = 2000) -> float:
    start = (0.0, 0.0, 0.0)
    rounds = []
    for _ in range(7):
        estimator = FILTERS[name](start, Inputs(0.5, 0.1), np.random.default_rng(1))
        began_s = perf_counter()
        for k in range(1, steps + 1):
            estimator.correct(k * STEP_NS, 0.035 * k, 0.0, Inputs(0.5, 0.0))
        rounds.append((perf_counter() - began_s) / steps * 1e6)
    return statistics.median(rounds)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100)
    runs = parser.parse_args().runs
    missed = 0
    print("path     detections  filter  printed     ours  +- s.e.  expected  tolerance")
    for (path, detections, name), (printed, expected, tolerance) in CELLS.items():
        found = errors_m(FILTERS[name], PATHS[path](), detections, runs)
        within = abs(found.mean() - expected) <= tolerance
        missed += not within
        print(f"{path:8s} {detections:10d}  {name:6s} {printed:8.4f} {found.mean():8.4f} "
              f"{found.std(ddof=1) / runs ** 0.5:8.4f} {expected:9.4f} {tolerance:10.4f}  {'' if within else 'MISSED'}",
              flush=True)
    for name, goal_us in GOAL_US.items():
        print(f"{name}: {step_us(name):.1f} us a step, goal {goal_us:g}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
