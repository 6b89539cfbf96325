"""Measures a flight that pymavlink commands in virtual time: parameters, take-off, 10 s of hovering, landing.

    python -m benchmarks.pymavlink_flight [--repeats 3]

The programs and the scenario are those of tests/firmware_sim/mavlink/test_pymavlink_in_virtual_time.py: an unmodified
ground station over UDP, the quadrotor's autopilot and its plant. Wall: from the first grant to the last report.
Processor: of all processes of the run, with loading and start. Medians of the repeated runs.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table

from benchmarks.processor_time import processor_s
from experiments import CODE
from experiments.run.node_host import HostName
from experiments.run.runner import run
from tests.firmware_sim.mavlink.test_pymavlink_in_virtual_time import scenario

LENGTH_S = 20.0
GOAL = 5.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    about = f"{LENGTH_S:g} s of flight; {CODE}; load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    table = Table("host", "wall s", "processor s", "x real time", "goal", "hash", title=about)
    hosts: tuple[HostName, ...] = ("inline", "process")
    for host in hosts:
        walls_s, used_s, hashes = [], [], set()
        for _ in range(options.repeats):
            before_s = processor_s()
            with tempfile.TemporaryDirectory() as folder:
                made = scenario(Path(folder), "udpout:127.0.0.1:14580", LENGTH_S)
                summary = run(made, host=host, out=Path(folder) / "out", report=False).summary
            assert summary.holds, f"{host}: the flight failed"
            walls_s.append(summary.wall_s)
            used_s.append(processor_s() - before_s)
            hashes.add(summary.ledger_hash[:6])
        wall_s = median(walls_s)
        table.add_row(host, f"{wall_s:.2f}", f"{median(used_s):.2f}", f"{LENGTH_S / wall_s:.1f}", f"{GOAL:g}",
                      ", ".join(hashes))
    Console().print(table)


if __name__ == "__main__":
    main()
