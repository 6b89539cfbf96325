"""Compares the ring in marconet, HELICS and mosaik, interleaved (A B C A B C), each run in new processes.

    python -m benchmarks.lockstep.compare                                  # about four minutes on two cores
    python -m benchmarks.lockstep.compare --sizes 2 5 --repeats 5 --out figures.json

Prints medians over the repeats and writes every run, with the load average before it, as JSON. "ours" is marconet's
number of windows per second divided by the peer's. `ring.py` defines the work, `helics_ring.py` and `mosaik_ring.py`
have the peers' settings. The goal is to be ahead of HELICS (TCP core) and mosaik at every size.

"HELICS ring only" waits for neighbours only, less than the work requires (its lead is above 0), so it is not part of
the goal. mosaik does so too, and has no other mode.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.lockstep.children import GRACE_S

GRANTS_PER_RUN = 8_000
WARM_UP_SHARE = 10                  # one window in ten
STOP_SPARE_S = 60.0                 # for start-up and shut-down, in addition to the limit for the turns
PACKAGES = ("marconet", "eclipse-zenoh", "helics", "mosaik")


@dataclass(frozen=True)
class Contender:
    title: str
    module: str
    needs: str                      # the package that has to be installed
    options: tuple[str, ...] = ()
    goal: bool = False              # whether the goal is to be ahead of it


OURS = Contender("marconet", "benchmarks.lockstep.marconet_ring", "zenoh")
CONTENDERS = (
    OURS,
    Contender("HELICS tcp", "benchmarks.lockstep.helics_ring", "helics", ("--variant", "tcp"), goal=True),
    Contender("mosaik eager", "benchmarks.lockstep.mosaik_ring", "mosaik", ("--variant", "eager"), goal=True),
    Contender("HELICS tcp_ss", "benchmarks.lockstep.helics_ring", "helics", ("--variant", "tcp_ss"), goal=True),
    Contender("mosaik lazy", "benchmarks.lockstep.mosaik_ring", "mosaik", ("--variant", "lazy"), goal=True),
    Contender("HELICS ring only", "benchmarks.lockstep.helics_ring", "helics", ("--variant", "tcp_targeted")),
)


@dataclass(frozen=True)
class Run:
    contender: str
    nodes: int
    windows: int
    repeat: int
    load_average: float             # over the minute before the run
    windows_per_s: float = 0.0
    lead_windows: int = 0
    settings: str = ""
    problem: str = ""               # reason why there is no figure, "" if there is one


def run_once(contender: Contender, nodes: int, windows: int, repeat: int, limit_s: float) -> Run:
    """Run a contender in a process group of its own, which is killed as a whole if the run does not end in time."""
    load = os.getloadavg()[0]
    if find_spec(contender.needs) is None:
        return Run(contender.title, nodes, windows, repeat, load, problem="not installed")
    command = [sys.executable, "-m", contender.module, *contender.options, "--nodes", str(nodes), "--windows",
               str(windows), "--warm-up", str(max(1, windows // WARM_UP_SHARE)), "--limit-s", str(limit_s)]
    child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                             text=True, process_group=0)
    try:
        out, err = child.communicate(timeout=limit_s + STOP_SPARE_S)
    except subprocess.TimeoutExpired:
        return Run(contender.title, nodes, windows, repeat, load,
                   problem=f"no end after {limit_s + STOP_SPARE_S:.0f} s")
    finally:
        end_group(child)
    if child.returncode:
        last_line = err.strip().rpartition("\n")[2]
        return Run(contender.title, nodes, windows, repeat, load, problem=last_line or f"exit code {child.returncode}")
    figure = json.loads(out.strip().rpartition("\n")[2])
    return Run(contender.title, nodes, windows, repeat, load, figure["windows_per_s"], figure["lead_windows"],
               figure["settings"])


def end_group(child: subprocess.Popen[str]) -> None:
    """Kill the child's process group: the child and the nodes that it started, as far as they still run."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(child.pid, number)
        except ProcessLookupError:
            break
        deadline_s = time.monotonic() + GRACE_S
        while child.poll() is None and time.monotonic() < deadline_s:
            time.sleep(0.01)
    child.wait()


def machine() -> dict[str, str | int]:
    cpu = next((line.partition(":")[2].strip() for line in _lines("/proc/cpuinfo") if line.startswith("model name")),
               platform.processor())
    return {"cpu": cpu, "cores": os.cpu_count() or 0, "system": f"{platform.system()} {platform.release()}",
            "python": platform.python_version(), **{package: _version(package) for package in PACKAGES}}


def _lines(path: str) -> list[str]:
    return Path(path).read_text().splitlines() if Path(path).exists() else []


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def median_windows_per_s(runs: Sequence[Run], contender: Contender, nodes: int) -> float | None:
    rates = [run.windows_per_s for run in runs
             if run.contender == contender.title and run.nodes == nodes and not run.problem]
    return statistics.median(rates) if rates else None


def table(runs: Sequence[Run], sizes: Sequence[int]) -> Table:
    result = Table(title="lockstep, medians")
    result.add_column("nodes", justify="right")
    result.add_column("system")
    for heading in ("windows/s", "grants/s", "ours", "range of windows/s", "lead"):
        result.add_column(heading, justify="right")
    for nodes in sizes:
        ours = median_windows_per_s(runs, OURS, nodes)
        for contender in CONTENDERS:
            mine = [run for run in runs if run.contender == contender.title and run.nodes == nodes]
            rate = median_windows_per_s(runs, contender, nodes)
            if rate is None:
                result.add_row(str(nodes), contender.title, mine[0].problem if mine else "not run")
                continue
            rates = [run.windows_per_s for run in mine if not run.problem]
            failed = sum(1 for run in mine if run.problem)
            result.add_row(str(nodes), contender.title + (f" ({failed} void)" if failed else ""), f"{rate:.0f}",
                           f"{nodes * rate:.0f}", f"{ours / rate:.2f}" if ours else "-",
                           f"{min(rates):.0f} .. {max(rates):.0f}", str(max(run.lead_windows for run in mine)),
                           end_section=contender is CONTENDERS[-1])
    return result


def verdict(runs: Sequence[Run], sizes: Sequence[int]) -> str:
    """Name the peers and sizes at which the goal is missed; a void run of marconet, or no peer, is no success."""
    void = sorted({run.nodes for run in runs if run.contender == OURS.title and run.problem})
    if void:
        return f"void: marconet has no figure for some runs at {', '.join(map(str, void))} nodes"
    behind, compared = [], 0
    for nodes in sizes:
        ours = median_windows_per_s(runs, OURS, nodes) or 0.0
        for contender in CONTENDERS:
            theirs = median_windows_per_s(runs, contender, nodes)
            if contender.goal and theirs is not None:
                compared += 1
                if ours <= theirs:
                    behind.append(f"{contender.title} at {nodes} nodes")
    if behind:
        return f"behind {', '.join(behind)}"
    return f"ahead in all {compared} comparisons that the goal names" if compared else "no peer was measured"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[2, 5, 16, 64])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--windows", type=int, default=0, help=f"per run; default {GRANTS_PER_RUN} / nodes")
    parser.add_argument("--limit-s", type=float, default=60.0, help="give up on one run after this long")
    parser.add_argument("--only", default="", help="contenders whose name contains this, and marconet")
    parser.add_argument("--out", type=Path, default=Path("lockstep.json"))
    given = parser.parse_args()
    console = Console()
    console.print(machine())
    began_s = time.monotonic()
    runs: list[Run] = []
    for nodes in given.sizes:
        windows = given.windows or GRANTS_PER_RUN // nodes
        for repeat in range(given.repeats):
            for contender in (one for one in CONTENDERS if one is OURS or given.only.lower() in one.title.lower()):
                run = run_once(contender, nodes, windows, repeat, given.limit_s)
                runs.append(run)
                console.print(f"{nodes:3} nodes  {contender.title:17} "
                              f"{run.problem or f'{run.windows_per_s:.0f} windows/s'}  (load {run.load_average:.1f})")
    console.print(table(runs, given.sizes))
    console.print(verdict(runs, given.sizes))
    given.out.write_text(json.dumps({
        "machine": machine(), "duration_s": round(time.monotonic() - began_s, 1), "verdict": verdict(runs, given.sizes),
        "medians": [{"contender": contender.title, "nodes": nodes,
                     "windows_per_s": (rate := median_windows_per_s(runs, contender, nodes)),
                     "grants_per_s": None if rate is None else nodes * rate}
                    for nodes in given.sizes for contender in CONTENDERS],
        "runs": [asdict(run) for run in runs]}, indent=1) + "\n")
    console.print(f"written to {given.out} after {time.monotonic() - began_s:.0f} s")


if __name__ == "__main__":
    main()
