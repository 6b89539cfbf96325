"""One core or all: the tests say how long windows take."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from netem.node.node import Node
from netem.transport.hosts import InlineHost
from netem.transport.placement import (
    HELD_WINDOWS,
    MOST_HELD_WINDOWS,
    SETTLE_WINDOWS,
    TRIAL_WINDOWS,
    TRIALS,
    Placement,
    place_threads,
)
from netem.wire.messages import Grant, Report

CORES = {0, 1, 2}
WINDOWS_TO_DECIDE = SETTLE_WINDOWS + TRIALS * TRIAL_WINDOWS


class Machine:
    """Windows that take `one_s` on one core and `all_s` on all; remembers where processes were put last."""

    def __init__(self, one_s: float, all_s: float, cores: set[int] = CORES) -> None:
        self.one_s, self.all_s = one_s, all_s
        self.moves: list[tuple[int, set[int]]] = []
        self.placement = Placement(lambda: [11, 12], self.put, cores)

    def put(self, process: int, cores: set[int]) -> None:
        self.moves.append((process, cores))

    def run(self, windows: int, grants: Callable[[int], int] = lambda window: 1) -> int:
        """Windows spent on one core."""
        on_one = 0
        for window in range(windows):
            on_one += self.placement.on_one_core
            each_s = self.one_s if self.placement.on_one_core else self.all_s
            self.placement.exchanged(grants(window), grants(window) * each_s)
        return on_one


@pytest.mark.parametrize(("one_s", "all_s", "goes_to_one"),
                         [(1e-4, 2e-4, True), (2e-4, 1e-4, False), (1e-4, 1e-4, False)])
def test_the_faster_placement_is_held(one_s: float, all_s: float, goes_to_one: bool) -> None:
    machine = Machine(one_s, all_s)

    machine.run(WINDOWS_TO_DECIDE)
    on_one = machine.run(HELD_WINDOWS - 1)

    assert on_one == (HELD_WINDOWS - 1 if goes_to_one else 0)


def test_windows_of_unequal_work_are_compared_by_grant() -> None:
    """The trials on one core happen to get three times the grants, and are faster all the same."""
    machine = Machine(1e-4, 1.5e-4)

    machine.run(WINDOWS_TO_DECIDE, lambda window: 3 if machine.placement.on_one_core else 1)

    assert machine.placement.on_one_core


def test_it_tries_again_when_the_load_may_have_changed() -> None:
    machine = Machine(1e-4, 2e-4)
    machine.run(WINDOWS_TO_DECIDE + HELD_WINDOWS - 1)
    machine.one_s = 4e-4                        # somebody else needs that core now

    machine.run(1 + TRIALS * TRIAL_WINDOWS)

    assert not machine.placement.on_one_core


def test_what_proves_itself_is_tried_out_less_often() -> None:
    machine = Machine(1e-4, 2e-4)
    machine.run(WINDOWS_TO_DECIDE + HELD_WINDOWS + TRIALS * TRIAL_WINDOWS)

    on_one = machine.run(2 * HELD_WINDOWS - 1)
    machine.run(1 + 60 * HELD_WINDOWS)
    held = []
    for _ in range(2 * MOST_HELD_WINDOWS):
        held.append(machine.run(1))

    assert on_one == 2 * HELD_WINDOWS - 1
    assert 1 - sum(held) / len(held) <= (TRIALS / 2 * TRIAL_WINDOWS) * 2 / MOST_HELD_WINDOWS


def test_all_processes_move_and_return_at_the_end() -> None:
    machine = Machine(1e-4, 2e-4)
    machine.run(SETTLE_WINDOWS)
    there, machine.moves = machine.moves, []

    machine.placement.end()

    assert [process for process, _ in there] == [11, 12]
    assert all(len(cores) == 1 and cores <= CORES for _, cores in there)
    assert machine.moves == [(11, CORES), (12, CORES)]


def test_an_inline_host_tells_the_time_that_its_nodes_took_but_not_the_time_between() -> None:
    spent_s: list[float] = []

    class Listening(Placement):
        def exchanged(self, grants: int, spent: float) -> None:
            assert grants == 1
            spent_s.append(spent)

    class Slow(Node):
        def advance(self, grant: Grant) -> Report:
            time.sleep(0.02)
            return super().advance(grant)

    host = InlineHost({"a": lambda: Slow("a", [])}, placement=Listening(list, lambda process, cores: None, CORES))
    host.start()
    host.exchange([("a", Grant(1, 1000, False, False, []))])
    time.sleep(0.05)
    began_s = time.perf_counter()
    host.exchange([("a", Grant(2, 2000, False, False, []))])
    took_s = time.perf_counter() - began_s
    host.stop()

    assert len(spent_s) == 2
    assert all(spent >= 0.02 for spent in spent_s)
    assert spent_s[1] <= took_s


@pytest.mark.parametrize("cores", [{0}, set()])
def test_a_machine_with_one_core_is_left_alone_and_so_is_a_run_in_real_time(cores: set[int]) -> None:
    machine = Machine(1e-4, 2e-4, cores)

    machine.run(2 * WINDOWS_TO_DECIDE)

    assert machine.moves == []


def test_without_proc_the_run_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def not_there(path: Path) -> str:
        raise FileNotFoundError(path)

    machine = Machine(1e-4, 2e-4)
    monkeypatch.setattr(Path, "read_text", not_there)

    machine.run(WINDOWS_TO_DECIDE)

    assert machine.moves[-1] == (12, {0})


def test_every_thread_of_a_process_is_placed() -> None:
    code = "import threading, sys; threading.Thread(target=sys.stdin.read).start(); print(flush=True); sys.stdin.read()"
    core = min(os.sched_getaffinity(0))
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()

        place_threads(process.pid, {core})

        threads = [int(thread.name) for thread in Path(f"/proc/{process.pid}/task").iterdir()]
        assert len(threads) == 2
        assert [os.sched_getaffinity(thread) for thread in threads] == [{core}, {core}]
        process.communicate(b"")


def test_a_process_that_has_ended_is_no_error() -> None:
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()

    place_threads(process.pid, {0})
