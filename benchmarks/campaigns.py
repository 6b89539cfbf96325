"""Measures what a campaign costs beside the emulation, what a second worker brings, and whether memory grows.

    python -m benchmarks.campaigns share [LENGTH_S [RUNS]]      share of the processor time that is emulation
    python -m benchmarks.campaigns workers [LENGTH_S [RUNS]]    runs per second with one worker and with two
    python -m benchmarks.campaigns memory [LENGTH_S [RUNS]]     private memory of a worker after each tenth of the runs

The scenario is `output_sync`. The first runs of each worker, which import modules, build plants and fill caches, are
not counted. Emulation is from the first grant to the finished ledger.
"""

from __future__ import annotations

import os
import sys
import time
from itertools import islice
from pathlib import Path
from statistics import median

from experiments import CODE
from experiments.scenario import find
from experiments.sweep.messages import Point, Source
from experiments.sweep.workers import Workers

NAME = "output_sync"
WARM_UP = 10
ROUNDS = 3


def points(runs: int) -> list[Point]:
    return [Point(number, {}, number) for number in range(runs)]


def share(length_s: float, runs: int) -> None:
    with Workers(Source.of(find(NAME), length_s), "inline", 1) as workers:
        found = [figures for _, figures in workers.evaluate(points(WARM_UP + runs))][WARM_UP:]
    emulation_s, whole_s = (sum(getattr(figures, name) for figures in found) for name in ("emulation_s", "whole_s"))
    print(f"{NAME}, {length_s:g} s, {CODE.partition(':')[0]}, {runs} runs: {whole_s / runs * 1e3:.1f} ms of processor "
          f"time each, {100 * emulation_s / whole_s:.1f} % of it emulation; median of the runs "
          f"{100 * median(one.emulation_s / one.whole_s for one in found):.1f} %")


def workers(length_s: float, runs: int) -> None:
    """One worker and two in turn; the ratio is that of the best rounds, as other work on the machine only slows."""
    source = Source.of(find(NAME), length_s)
    rates: dict[int, list[float]] = {1: [], 2: []}
    with Workers(source, "inline", 1) as one, Workers(source, "inline", 2) as two:
        for jobs, pool in ((1, one), (2, two)):
            list(pool.evaluate(points(jobs * WARM_UP)))
        for _ in range(ROUNDS):
            for jobs, pool in ((1, one), (2, two)):
                began_s = time.perf_counter()
                ended = sum(1 for _ in pool.evaluate(points(runs)))
                rates[jobs].append(ended / (time.perf_counter() - began_s))
    print(f"{NAME}, {length_s:g} s, {CODE.partition(':')[0]}, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores: "
          f"one worker {max(rates[1]):.1f} runs/s, two {max(rates[2]):.1f}, ratio {max(rates[2]) / max(rates[1]):.2f}")


def memory(length_s: float, runs: int) -> None:
    with Workers(Source.of(find(NAME), length_s), "inline", 1) as one:
        ended = one.evaluate(points(runs))
        for tenth in range(10):
            for _ in islice(ended, runs // 10):
                pass
            print(f"after {(tenth + 1) * (runs // 10)} runs: {private_kb(one.pids[0])} kB", flush=True)


def private_kb(pid: int) -> int:
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith("Private_"))


if __name__ == "__main__":
    measure, length_s, runs = {"share": (share, 1.0, 100), "workers": (workers, 1.0, 100),
                               "memory": (memory, 0.05, 10_000)}[sys.argv[1] if len(sys.argv) > 1 else "share"]
    given = sys.argv[2:]
    measure(float(given[0]) if given else length_s, int(given[1]) if len(given) > 1 else runs)
