"""Compares what a tracking robot acts on between noisy looks: the measurement y^, an unscented or a particle filter.

    python -m benchmarks.observed_looks [RUNS]

Each runs the learned policy of section 5.3, inputs (1, 1), S = 0.0015, without a network for 12 s from x = 0. Printed
are the cost per second and the looks of a run, means with 95 % intervals, and in how many looks all particles died.
"""

from __future__ import annotations

import sys

import numpy as np

from agents.optimal_triggering.observers import Observer, ParticleObserver, UnscentedObserver
from agents.optimal_triggering.rollouts import confidence, roll_out
from agents.tracking.section_5_3 import LOOP, learned

LOOK_COST, LENGTH_S = 0.0015, 12.0


def main(runs: int = 100) -> None:
    policy = learned(LOOK_COST).policy
    particles = ParticleObserver(LOOP, runs, np.random.default_rng(2))
    observers: dict[str, Observer | None] = {"y^": None, "unscented": UnscentedObserver(LOOP, runs),
                                             "particle": particles}
    for name, observer in observers.items():
        found = roll_out(LOOP, policy, np.zeros(3), LENGTH_S, runs, np.random.default_rng(1), observer=observer)
        print(f"{name:9}  cost per second {found.rate(LOOK_COST)}  looks {confidence(found.looks)}")
    print(f"particles that all died: {particles.reinitialized} times")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
