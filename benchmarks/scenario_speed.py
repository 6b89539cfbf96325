"""Measures speed, start-up and memory of scenarios: `python -m benchmarks.scenario_speed [NAME ...] [--repeats 3]`.

Every figure is the median over complete runs with all records. Real-time factor: simulated time / wall time from the
first grant to the last report. Start: wall time from the call of the runner to the first grant. Whole: wall time with
loading, start, Parquet, MCAP and report.html. Memory: private memory of the largest robot process at half of the run
(Linux: Private_Clean + Private_Dirty of smaps_rollup).
"""

from __future__ import annotations

import argparse
import os
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.table import Table

from experiments import CODE
from experiments.judge.run_result import Progress
from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import find, load

SCENARIOS = ("output_sync", "output_sync_16", "tracking_individual", "hummingbird_chases_rovio")
GOAL = {("output_sync", "process"): 5.0, ("output_sync", "inline"): 20.0, ("output_sync_16", "process"): 2.0,
        ("tracking_individual", "process"): 5.0, ("hummingbird_chases_rovio", "process"): 2.0}


def children(process: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{process}/task/{process}/children").read_text().split()]


def private_mb_of_nodes() -> list[float]:
    """Private memory of every node's process, in MB (10^6 bytes): they are forked from a child of this process."""
    sizes = []
    for child in (node for server in children(os.getpid()) for node in children(server)):
        rollup = Path(f"/proc/{child}/smaps_rollup").read_text().splitlines()
        sizes.append(sum(int(line.split()[1]) for line in rollup if line.startswith("Private_")) * 1024 / 1e6)
    return sizes


def memory_probe(found: list[float]) -> Callable[[Progress], None]:
    def look(progress: Progress) -> None:
        if not found and progress.now_ns > progress.end_ns // 2:
            found.extend(private_mb_of_nodes())
    return look


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", nargs="*", default=SCENARIOS)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--duration", type=float, default=None, help="seconds of robot time instead of the scenario's")
    options = parser.parse_args()
    about = f"{CODE}; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores; medians of {options.repeats}"
    table = Table("scenario", "host", "x real time", "goal", "start s", "whole s", "MB", "hash", title=about)
    hosts: tuple[HostName, ...] = ("process", "inline")
    for name in options.scenarios:
        for host in hosts:
            factors, starts, wholes, hashes, memory = [], [], [], set(), []
            for _ in range(options.repeats):
                found: list[float] = []
                with tempfile.TemporaryDirectory() as folder:
                    began_s = time.perf_counter()
                    scenario = load(find(name), duration_s=options.duration)
                    measurable = host == "process" and Path("/proc/self/smaps_rollup").exists()
                    probe = memory_probe(found) if measurable else None
                    summary = run(scenario, host=host, out=Path(folder), progress=probe).summary
                    wholes.append(time.perf_counter() - began_s)
                factors.append(summary.real_time_factor)
                starts.append(summary.start_up_s)
                hashes.add(summary.ledger_hash[:6])
                memory.append(max(found, default=0.0))
            goal = GOAL.get((name, host))
            table.add_row(name, host, f"{statistics.median(factors):.2f}", f"{goal or ''}",
                          f"{statistics.median(starts):.2f}", f"{statistics.median(wholes):.2f}",
                          f"{statistics.median(memory):.0f}" if host == "process" else "", ", ".join(sorted(hashes)))
    Console().print(table)


if __name__ == "__main__":
    main()
