"""Chooses the cores for emulator and nodes, one core or all, by measuring the speed of both during the run.

    settle --> one core, all cores, one core, ... TRIAL_WINDOWS each --> the faster one for HELD_WINDOWS --> again
                                     if it is the same one again: twice as long as before, up to MOST_HELD_WINDOWS

If one node at a time has something to do, one core is faster: each message to another core waits until that core wakes
up, and finds its caches cold. So does each change between the threads of blocking programs in one process. If many
nodes work in parallel, or one works for long, all cores are. The choice depends on scenario, machine and its other
load. It changes the speed alone: a node's offers do not depend on its core. The time between windows does not count, as
a view may hold the run there. A run in real time tries nothing, as the slower choice would make frames late.

Not modelled: some nodes on one core and others elsewhere; groups of cores that share a cache.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Final

from mypy_extensions import mypyc_attr

SETTLE_WINDOWS: Final = 50
TRIAL_WINDOWS: Final = 60
TRIALS: Final = 4               # alternating; the faster trial of each choice counts, as other load slows trials down
HELD_WINDOWS: Final = 6_000
MOST_HELD_WINDOWS: Final = 48_000
WORTH_IT: Final = 0.97          # one core is chosen if it takes less than this share of the time on all cores


@mypyc_attr(allow_interpreted_subclasses=True)
class Placement:
    """Moves the processes whose ids `processes` returns, this one included; the host calls `exchanged` every window.

    `cores` are those to choose from, None for all that this process may use; with one or none it moves nothing.
    `place(process, cores)` lets a process run on these cores only.
    """

    def __init__(self, processes: Callable[[], Iterable[int]], place: Callable[[int, set[int]], None] | None = None,
                 cores: set[int] | None = None) -> None:
        self._processes = processes
        self._place = place or place_threads
        self._cores = _own_cores() if cores is None else cores
        self._left = SETTLE_WINDOWS if len(self._cores) > 1 else 0
        self._laps: list[float] = []        # seconds per grant of each trial so far, the first on one core
        self._tries = False                 # a trial is going on
        self._grants = 0
        self._spent_s = 0.0
        self._held = 0
        self._decision: bool | None = None
        self.on_one_core = False

    def exchanged(self, grants: int, spent_s: float) -> None:
        """Count a window whose grants took `spent_s`; at the end of a trial begin the next one, or decide."""
        self._grants += grants
        self._spent_s += spent_s
        self._left -= 1
        if self._left == 0:
            self._next()

    def end(self) -> None:
        """After the nodes have ended: let this process use all its cores again."""
        self._left = 0
        self._move(to_one=False)

    def _next(self) -> None:
        if self._tries:
            self._laps.append(self._spent_s / max(1, self._grants))
        if len(self._laps) == TRIALS:
            to_one = min(self._laps[::2]) < WORTH_IT * min(self._laps[1::2])
            self._held = min(2 * self._held, MOST_HELD_WINDOWS) if to_one is self._decision else HELD_WINDOWS
            self._decision = to_one
            self._laps.clear()
            self._tries, self._left = False, self._held
            self._move(to_one)
            return
        self._move(len(self._laps) % 2 == 0)
        self._tries, self._left, self._grants, self._spent_s = True, TRIAL_WINDOWS, 0, 0.0

    def _move(self, to_one: bool) -> None:
        if to_one == self.on_one_core:
            return
        self.on_one_core = to_one
        cores = {_current_core(self._cores)} if to_one else self._cores
        for process in self._processes():
            self._place(process, cores)


def place_threads(process: int, cores: set[int]) -> None:
    """Let every thread of `process` run on `cores`; threads that it starts later inherit that."""
    with suppress(OSError):                 # the process has ended
        for thread in Path(f"/proc/{process}/task").iterdir():
            with suppress(OSError):
                os.sched_setaffinity(int(thread.name), cores)


def _own_cores() -> set[int]:
    return os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()


def _current_core(cores: set[int]) -> int:
    """The core that this thread runs on (field 39 of its `stat`); any of `cores` if there is no `/proc`."""
    core = -1
    with suppress(OSError):
        core = int(Path("/proc/thread-self/stat").read_text().rpartition(")")[2].split()[36])
    return core if core in cores else min(cores)
