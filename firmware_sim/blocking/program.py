"""A blocking program: its threads, what each waits for, the promise of silence that follows, and its end.

    wait() in a program's thread --suspend--> node's agenda --event--> run_if_due() --resume--> wait() returns

A thread that waits runs the node's next event itself if that lets a thread of its program go on at this instant: it
hands over to that thread, so that a frame which one thread takes for another costs three changes of threads, not four.

Durations are measured on the node's oscillator: its drift and tick, but neither offset nor steps of its clock, as
CLOCK_MONOTONIC does on the robot. The time of day is the board's local clock.

Promises: while all threads wait, the promise is the first instant at which one goes on, *firm*; if one also waits for
frames, it is *soft*. A program that has ended promises to send nothing any more.

The program ends when its function and every non-daemon thread have ended. An exception in any of its threads ends the
node (differs from plain Python, where only the thread ends). At the end of the run the program gets a Ctrl-C.
"""

from __future__ import annotations

import asyncio
import sys
import time
import traceback
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from heapq import heappop
from inspect import iscoroutinefunction
from random import Random
from signal import SIG_DFL, SIG_IGN, SIGINT, SIGTERM, default_int_handler
from threading import Thread
from typing import Any, Final
from weakref import WeakKeyDictionary, WeakSet

from simpy.events import Event

from firmware_sim.blocking.calls_in_a_row import SHORTEST_NS
from firmware_sim.blocking.program_thread import OF_THIS_THREAD, ProgramThread
from firmware_sim.blocking.repeating import Repeating
from firmware_sim.blocking.resuming import abandon, resume
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.local_clock import LocalClock
from firmware_sim.sockets.interface import Interface
from netem.node.node import Node
from netem.wire.instants import NEVER_NS

CLEANUP_NS: Final = 10_000_000_000          # virtual time to clean up after the end of the run
CLEANUP_S: Final = 2.0                      # wall-clock time to clean up
MOST_HANDOVERS: Final = 1000                # of threads to one another, or to themselves, at one instant

_wall_s = time.monotonic


class BlockingProgram:
    """`load` returns the program's function; it runs in the program's own thread, so that imports use virtual time.

    A coroutine function runs in an event loop of its own. `name` is what the program finds in `sys.argv`.
    """

    def __init__(self, node: Node, board: Board, clock: ClockSettings, load: Callable[[], Callable[..., object]],
                 parameters: Mapping[str, Any] | None = None, can_buses: Sequence[str] = (),
                 own_frames: Collection[str] = (), interfaces: Sequence[Interface] = (), name: str = "") -> None:
        self.board = board
        self.node = node
        self.oscillator = LocalClock(ClockSettings(0, clock.drift_ppm, clock.tick_ns), node.env.time_ns)
        self.handlers: dict[int, Any] = {}          # signal handlers that the program has set
        self.closing = False                        # the run has ended: frames that the program sends are dropped
        self.over = False                           # the program has ended
        self.repeating: list[Repeating] = []
        self.can_buses = tuple(can_buses)           # the ports that python-can opens
        self.own_frames = frozenset(own_frames)     # media that deliver the node's own frames once they got through
        self.interfaces = tuple(interfaces)         # media that its sockets use
        self.shared: dict[tuple[str, str], Any] = {}    # data that an adapter keeps for the whole program
        self.random = Random(board.rng.getrandbits(64))     # what the functions of the module `random` draw from
        self.files: WeakSet[Any] = WeakSet()        # its open sockets, closed with its last thread
        self.os_threads: WeakKeyDictionary[Thread, ProgramThread] = WeakKeyDictionary()
        self._load = load
        self._parameters = dict(parameters or {})
        self._threads: list[ProgramThread] = []
        self._running: ProgramThread | None = None
        self._handovers = 0             # how often its threads may still hand over to one another at `_instant_ns`
        self._instant_ns = -1
        self._argv = [name]
        self._main = ProgramThread(f"{self.node.name}: the program", daemon=False)
        self.main_thread = Thread(target=self._main.live, args=(self._whole_program,), name="MainThread", daemon=False)
        self.os_threads[self.main_thread] = self._main

    # --- begin and end, called by the builder of the node

    def begin(self) -> None:
        """Load the function, which is called at the start of the run; raises any exception of the loading."""
        for port in self.node.ports.values():
            port.on_receive = _drop
        self._threads.append(self._main)
        self.main_thread.start()
        self._run(self._main)

    def finish(self) -> None:
        """End the program at the end of the run: by a Ctrl-C, some time to clean up, then the end of its threads."""
        if self.closing:
            return
        self.closing = True
        deadline_s = _wall_s() + CLEANUP_S
        limit_ns = self.node.now_ns + CLEANUP_NS
        self._main.interrupted = True
        self.wake(self._main)
        try:
            while not self.over and self.node.env.next_ns() <= limit_ns and _wall_s() < deadline_s:
                self.node.env.step()
        except BaseException as error:
            if not isinstance(error, KeyboardInterrupt | SystemExit):
                traceback.print_exception(error)
        self._end_threads()

    def abandon(self) -> None:
        """End the threads of the program where they are; what its `finally` blocks send goes nowhere."""
        if not self.closing:
            self.closing = True
            self._end_threads()

    def _end_threads(self) -> None:
        for thread in list(self._threads):
            self._running = thread
            if not thread.ended and not abandon(thread):
                print(f"{thread.name} did not end with the run", file=sys.stderr, flush=True)
        self._running = None
        for file in list(self.files):
            file.close()

    # --- calls of the program's threads

    def thread(self) -> ProgramThread:
        """Return the running thread."""
        assert self._running is not None, "called from outside of the program's threads"
        return self._running

    def owns(self, thread: ProgramThread) -> bool:
        return thread in self._threads

    def due_ns(self, timeout_ns: int) -> int:
        """Return the true time at which `timeout_ns` of the oscillator will have passed, at most `NEVER_NS`."""
        return min(NEVER_NS, self.oscillator.true_at(self.oscillator.now_ns() + timeout_ns))

    def wait(self, until_ns: int = NEVER_NS, *, hears: bool = False) -> bool:
        """Wait until the thread is woken (returns True) or until true time `until_ns` (returns False).

        With `hears` a frame may wake the thread, so the node's promise is soft.
        """
        began_ns = self.node.now_ns
        woken = self._wait(until_ns, hears)
        if self.node.now_ns - began_ns >= SHORTEST_NS:
            self.thread().row.end()
        return woken

    def _wait(self, until_ns: int, hears: bool) -> bool:
        thread = self.thread()
        thread.until_ns, thread.hears, thread.woken, thread.waiting = until_ns, hears, False, True
        self._arm(thread)
        other = self._next_at_once()
        if other is None:
            thread.suspend()
        elif other is thread:
            thread.waiting = False
        else:
            self._running = other
            thread.suspend_for(other)
        if thread.interrupted:
            thread.interrupted = False
            self._interrupt()
        return thread.woken

    def _next_at_once(self) -> ProgramThread | None:
        """Take the node's next event if it lets a thread of this program run at this instant; return that thread.

        After MOST_HANDOVERS at this instant the result is None, so that the node's thread goes on, which counts events
        and refuses an instant that does not end.
        """
        if not self._handovers or self.closing:
            return None
        queue, now_ns = self.node.env.queue, self.node.now_ns
        while queue and queue[0][0] == now_ns:
            calls = queue[0][3].callbacks
            check = calls[0] if calls else None
            if not isinstance(check, Check) or check.program is not self:
                return None
            heappop(queue)
            if self._is_due(check.thread):
                self._handovers -= 1
                return check.thread
        return None

    def sleep(self, duration_ns: int) -> None:
        if duration_ns < SHORTEST_NS:
            self.note_call()
        until_ns = self.due_ns(duration_ns)
        while self.wait(until_ns):
            pass

    def wake(self, thread: ProgramThread) -> None:
        """Let `thread` continue at this instant, if it waits."""
        if thread.waiting and not thread.woken and not self.over:
            thread.woken = True
            thread.until_ns = self.node.now_ns
            self._check_after(0, thread)

    def start(self, function: Callable[[], object], name: str, *, daemon: bool,
              spawn: Callable[[Callable[[], None]], object]) -> ProgramThread:
        """Start one more thread, whose OS thread `spawn` starts; it first runs when the calling thread waits."""
        thread = ProgramThread(f"{self.node.name}: {name}", daemon=daemon)

        def body() -> None:
            OF_THIS_THREAD.program = self
            function()

        spawn(partial(thread.live, body))
        self._threads.append(thread)
        thread.until_ns = self.node.now_ns
        self._check_after(0, thread)
        return thread

    def await_end(self, thread: ProgramThread, timeout_ns: int | None) -> None:
        until_ns = NEVER_NS if timeout_ns is None else self.due_ns(timeout_ns)
        me = self.thread()
        thread.joiners.append(me)
        try:
            while not thread.ended and self.wait(until_ns):
                pass
        finally:
            thread.joiners.remove(me)

    def send(self, port: str, data: bytes) -> None:
        if not self.closing:
            self.node.ports[port].send(data)

    def note_call(self) -> None:
        """Count a call of the running thread that lets no time pass, and wait for its cost.

        The cost is 0 unless the thread has made many such calls in a row, see `calls_in_a_row.py`.
        """
        assert self._running is not None, "called from outside of the program's threads"
        cost_ns = self._running.row.next_cost_ns()
        if cost_ns:
            until_ns = self.due_ns(cost_ns)
            while self._wait(until_ns, hears=False):
                pass

    def monotonic_ns(self) -> int:
        """Read the node's oscillator, as a program that asks for the time does: counted as a call."""
        self.note_call()
        return self.oscillator.now_ns()

    def monotonic_s(self) -> float:
        self.note_call()
        return self.oscillator.now_ns() / 1e9

    def repeat(self, period_ns: int, duration_ns: int | None, action: Callable[[], None]) -> Repeating:
        """Call `action` now and every `period_ns` from now on, in the node's thread: it must not block."""
        return Repeating(self, period_ns, duration_ns, action)

    # --- in the node's thread; `_is_due` and `_arm` also in a thread that waits

    def call_after(self, delay_ns: int, action: Callable[[], None]) -> None:
        """Call `action` after `delay_ns`, and renew the promise afterwards."""
        def act(event: Event) -> None:
            action()
            self.promise()

        self.node.call_in(delay_ns, act)

    def _check_after(self, delay_ns: int, thread: ProgramThread) -> None:
        self.node.call_in(delay_ns, Check(self, thread))

    def run_if_due(self, thread: ProgramThread) -> None:
        """Run `thread` if it was woken or its time has come; otherwise schedule the next check."""
        if self._is_due(thread):
            if self._instant_ns != self.node.now_ns:
                self._instant_ns, self._handovers = self.node.now_ns, MOST_HANDOVERS
            self._run(thread)

    def _is_due(self, thread: ProgramThread) -> bool:
        now_ns = self.node.now_ns
        if thread.alarm_ns <= now_ns:
            thread.alarm_ns = NEVER_NS
        if not thread.waiting or thread.ended:
            return False
        if thread.woken or thread.until_ns <= now_ns:
            return True
        self._arm(thread)
        return False

    def _arm(self, thread: ProgramThread) -> None:
        """Schedule a check at the thread's time. A pending earlier check stays: to cancel it would cost more."""
        if thread.until_ns < thread.alarm_ns:
            thread.alarm_ns = thread.until_ns
            self._check_after(max(0, thread.until_ns - self.node.now_ns), thread)

    def _run(self, thread: ProgramThread) -> None:
        self._running = thread
        sys.argv = self._argv           # programs may share the process
        try:
            resume(thread)
            last = self.thread()
        finally:
            self._running = None
        if last.ended:
            self._reap(last)
        self.promise()

    def _reap(self, thread: ProgramThread) -> None:
        for joiner in thread.joiners:
            self.wake(joiner)
        self._threads.remove(thread)
        if thread.failure is not None:
            raise thread.failure
        self.over = all(other.daemon for other in self._threads)
        if self.over:
            for repeating in list(self.repeating):
                repeating.stop()
            for other in self._threads:         # daemons; one may have been woken at this instant
                other.until_ns, other.woken = NEVER_NS, False

    def promise(self) -> None:
        """Promise silence until the first instant at which a thread goes on; called when the node's thread goes on."""
        first_ns, hears = NEVER_NS, False
        if not self.over:
            for thread in self._threads:                # asked for each frame, so without calls
                if thread.until_ns < first_ns:
                    first_ns = thread.until_ns
                hears = hears or thread.hears
            for repeating in self.repeating:
                if repeating.next_ns < first_ns:
                    first_ns = repeating.next_ns
        if hears:
            self.node.promise_soft(first_ns)
        else:
            self.node.promise_firm(first_ns)

    def _interrupt(self) -> None:
        """Do what a Ctrl-C does, in the program's first thread, at the end of the run."""
        number = SIGINT if SIGINT in self.handlers or SIGTERM not in self.handlers else SIGTERM
        handler = self.handlers.get(number, default_int_handler)
        if callable(handler):
            handler(number, None)
        elif handler == SIG_DFL:
            raise KeyboardInterrupt
        else:
            assert handler == SIG_IGN

    def _whole_program(self) -> None:
        OF_THIS_THREAD.program = self
        function = self._load()
        self.wait(self.node.now_ns)         # the node is ready; the run starts
        try:
            if iscoroutinefunction(function):
                asyncio.run(function(**self._parameters))
            else:
                function(**self._parameters)
        except SystemExit as error:
            if error.code not in (None, 0):
                raise
        except KeyboardInterrupt:
            if not self.closing:
                raise


class Check:
    """A callback of an event on the node's agenda: lets `thread` of `program` go on if it is due."""

    def __init__(self, program: BlockingProgram, thread: ProgramThread) -> None:
        self.program = program
        self.thread = thread

    def __call__(self, event: Event) -> None:
        self.program.run_if_due(self.thread)


def _drop(data: bytes) -> None:
    """Drop a frame that arrives before the program has opened the port, as on the robot."""
