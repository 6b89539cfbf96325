"""Runs the ring in mosaik 3.6: one remote simulator (`cmd`, TCP on 127.0.0.1) with one entity per node.

    python -m benchmarks.lockstep.mosaik_ring --nodes 5 --windows 2000 --variant eager

Settings, chosen in favour of mosaik:
- time-based simulators, each connected to its neighbour with `time_shifted=True` and empty initial data: in step k
  mosaik delivers the data of step k - 1;
- no progress bar, debug off, no logging, real-time factor off; the cache is on (mosaik 3.6 cannot run without it);
- `lazy_stepping` is the variant: by default mosaik holds a simulator until its successor has caught up (`lazy`);
  otherwise a simulator steps as soon as its input is there (`eager`). In both mosaik waits for neighbours only, so
  nodes on opposite sides of the ring are some windows apart (the lead).
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import shutil
import signal
import sys
import tempfile
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

import mosaik

from benchmarks.lockstep.children import leave_on_sigterm
from benchmarks.lockstep.ring import Figure, Task, judge

MEMBER = "benchmarks.lockstep.mosaik_member"
VARIANTS = {"lazy": True, "eager": False}       # name -> lazy_stepping
START_LIMIT_S = 60


async def _run(task: Task, folder: str, lazy_stepping: bool) -> None:
    sim_config: mosaik.SimConfig = {"Ring": {"cmd": f"%(python)s -m {MEMBER} %(addr)s"}}
    async with mosaik.AsyncWorld(sim_config, {"addr": ("127.0.0.1", None), "start_timeout": START_LIMIT_S}) as world:
        factories = await asyncio.gather(*[
            world.start("Ring", index=index, task=asdict(task), folder=folder) for index in range(task.nodes)])
        nodes = [await factory.Node() for factory in factories]
        for index, node in enumerate(nodes):
            world.connect(node, nodes[(index + 1) % task.nodes], ("outbox", "inbox"), time_shifted=True,
                          initial_data={"outbox": ""})
        await world.run(until=task.windows, print_progress=False, lazy_stepping=lazy_stepping)


def run(task: Task, variant: str = "eager", limit_s: float = 120.0) -> Figure:
    """Run the task; after `limit_s` end this process, as mosaik cannot be cancelled within a turn.

    Its shutdown would wait for ever. The simulators end when their connections close.
    """
    with tempfile.TemporaryDirectory(prefix="lockstep_mosaik_") as folder:
        def give_up(*_: object) -> None:
            print(f"mosaik: no end after {limit_s:.0f} s", file=sys.stderr, flush=True)
            shutil.rmtree(folder, ignore_errors=True)
            os._exit(1)
        signal.signal(signal.SIGALRM, give_up)
        signal.setitimer(signal.ITIMER_REAL, limit_s)
        asyncio.run(_run(task, folder, VARIANTS[variant]))
        signal.setitimer(signal.ITIMER_REAL, 0)
        return judge("mosaik", task, Path(folder), f"{version('mosaik')}, {variant}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=5)
    parser.add_argument("--windows", type=int, default=2000)
    parser.add_argument("--warm-up", type=int, default=50)
    parser.add_argument("--variant", choices=VARIANTS, default="eager")
    parser.add_argument("--limit-s", type=float, default=120.0, help="give up after this long")
    given = parser.parse_args()
    leave_on_sigterm()
    figure = run(Task(given.nodes, given.windows, given.warm_up), given.variant, given.limit_s)
    print(json.dumps(asdict(figure)))


if __name__ == "__main__":
    main()
