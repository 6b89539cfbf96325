"""Runs a scenario with many seeds for its figures alone, without a folder or a report; seeds share what they can.

    scenario --specifications, resolved tables--> Repeated --seed--> figures, hash --collect--> the next seed

A process whose own it is calls `set_aside` when it has prepared a scenario: the collection after each run then reads
what the runs left, and not the modules.

*Invariants*
- The hash and the figures are those of `runner.run` with the same scenario, seed and host.
- After `run` nothing of the run is in memory but the `Figures` that it returned.

A program's `prepare` is asked once for all seeds, as what it is given (`firmware_sim/scenario_view.py`) has no seed.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import msgspec

from experiments.judge.figures import Figures
from experiments.judge.run_result import Summary
from experiments.run.exits import in_words
from experiments.run.node_host import HostName
from experiments.run.node_specifications import node_specifications
from experiments.run.run_records import FigureRecords
from experiments.run.runner import COLLECT_AFTER_OBJECTS, NeedsRealTime, execute
from experiments.scenario.model import Scenario
from experiments.scenario.problems import ScenarioError
from netem.transport.diagnosis.under_way import UnderWay
from netem.wire.errors import is_interruption

IN_MEMORY: Final = Path("/dev/shm")         # where processes of robots write their logs, if it is there


class Repeated:
    """A scenario prepared for many runs that differ in the seed. Refuses what `runner.run` would refuse.

    `load` returns the scenario with a seed, or with its own. It is asked once, or for each seed if the scenario has
    faults that occur at random times, which are drawn when it is loaded.
    """

    def __init__(self, load: Callable[[int | None], Scenario], host: HostName,
                 under_way: UnderWay | None = None) -> None:
        scenario = load(None)
        if scenario.gateways:
            raise NeedsRealTime(f"{scenario.name}: gateways.{next(iter(scenario.gateways))} lets somebody outside take "
                                "part, which needs real time: a campaign runs in virtual time")
        self._scenario = scenario
        self._load = load if any(fault.at_random for fault in scenario.faults) else None
        self._host: HostName = host
        self._under_way = under_way
        self._specifications = node_specifications(scenario)
        self._resolved = scenario.resolved()

    def run(self, seed: int) -> Figures:
        """Run with `seed` and return the figures, those of a failed run as well.

        Raises ScenarioError if the scenario asks for what no program records; interruptions pass.
        """
        began_s = time.process_time()
        with _collecting_afterwards():
            summary, failure = self._run(seed)
        if summary is None:
            return Figures(seed, "", False, {}, failure=failure, whole_s=time.process_time() - began_s)
        return Figures(seed, summary.ledger_hash, summary.holds, {it.key: it.value for it in summary.verdicts},
                       [it.key for it in summary.verdicts if not it.kept], failure or summary.failure,
                       summary.processor_s, time.process_time() - began_s)

    def _run(self, seed: int) -> tuple[Summary | None, str]:
        scenario = msgspec.structs.replace(self._scenario, seed=seed) if self._load is None else self._load(seed)
        specifications = {name: msgspec.structs.replace(specification, seed=seed)
                          for name, specification in self._specifications.items()}
        with _logs(self._host) as logs:
            resolved = self._resolved | {"seed": seed} if self._load is None else scenario.resolved()
            records = FigureRecords(scenario, resolved, logs)
            try:
                execute(scenario, self._host, records, specifications, self._under_way)
            except ScenarioError:
                raise
            except BaseException as error:
                if is_interruption(error):
                    raise
                return records.summary, in_words(error)
            finally:
                records.clear()
            return records.summary, ""


def set_aside(*, first_collect: bool) -> None:
    """Take all objects of this process out of the garbage collections to come.

    With `first_collect` those set aside before are collected first, as some of them may be garbage by now.
    """
    if first_collect:
        gc.unfreeze()
        gc.collect()
    gc.freeze()


@contextmanager
def _logs(host: HostName) -> Iterator[Path]:
    """Yield a folder for the logs of robots' processes, which is removed afterwards."""
    if host == "inline":
        yield Path()
        return
    with TemporaryDirectory(prefix="marconet-", dir=IN_MEMORY if IN_MEMORY.is_dir() else None) as folder:
        yield Path(folder)


@contextmanager
def _collecting_afterwards() -> Iterator[None]:
    """Let the garbage collector rest during the run and free the cycles that the run made when it is over."""
    threshold = gc.get_threshold()
    gc.set_threshold(COLLECT_AFTER_OBJECTS, 50, 100)
    try:
        yield
    finally:
        gc.set_threshold(*threshold)
        gc.collect()
