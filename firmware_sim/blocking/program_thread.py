"""One thread of a blocking program: it runs only between `resume` and `suspend`.

    node's thread: resume() --baton--> program's thread: runs until it waits, ends or fails --baton--> resume() returns
                                       suspend_for(next) --baton--> next: runs on --baton--> resume() returns

A thread that waits may hand over to another thread of its program, so that two changes of threads become one.

Invariants:
- either the node's thread or one thread of the program runs, never two, so their data needs no lock;
- an exception of the program's thread is kept in `failure`, and the node's thread raises it.
"""

from __future__ import annotations

import ctypes
import sys
import traceback
from _thread import get_ident  # the real one, whatever `library_time` puts into `threading`
from collections.abc import Callable
from threading import local
from typing import TYPE_CHECKING, Final

from firmware_sim.blocking.calls_in_a_row import CallsInARow
from netem.node.turn import STANDS_IN
from netem.wire.instants import NEVER_NS

if TYPE_CHECKING:
    from firmware_sim.blocking.c_batons import Baton, pass_on

    EventBaton = Baton
else:
    try:
        from firmware_sim.blocking.c_batons import Baton, pass_on

        EventBaton = Baton
    except ModuleNotFoundError:         # c_batons.c was not compiled
        from firmware_sim.blocking.python_batons import Baton, EventBaton, pass_on

PATIENCE_S: Final = 2.0         # wall clock; a thread that computes for longer is shown once in the node's log

LAST_CALLS: Final = 10          # waits that raise Abandoned before a thread counts as one that does not end


class _OfThisThread(local):
    program: object = None      # the blocking program that the calling thread belongs to, see `here.py`


OF_THIS_THREAD: Final = _OfThisThread()


class Abandoned(SystemExit):
    """Raised in a thread that has to end now; `threading` prints no traceback of a SystemExit."""


class ProgramThread:
    """The BlockingProgram sets `until_ns`, `hears`, `woken` and `alarm_ns`, and decides when the thread runs."""

    def __init__(self, name: str, *, daemon: bool) -> None:
        self.name = name
        self.daemon = daemon            # True: ends with the program's last non-daemon thread
        self.waiting = True             # set before it suspends itself; False once it is resumed
        self.woken = False
        self.hears = False              # True: a frame may wake it
        self.until_ns = 0               # true time at which it continues unless woken earlier
        self.alarm_ns = NEVER_NS        # true time of the next scheduled check whether it is due
        self.interrupted = False
        self.row = CallsInARow()
        self.joiners: list[ProgramThread] = []     # threads that wait for its end
        self.ended = False
        self.failure: BaseException | None = None
        self._abandoned = False
        self._ident = 0
        self._go = EventBaton()
        self._back = Baton()
        self._returns_to = self._back       # what lets the node's thread go on
        self._next: ProgramThread | None = None     # the thread that it handed over to since it was resumed
        self._turns = 0                     # how often it was let go
        self._node_ident = 0                # the thread that runs the node

    # --- in the node's thread

    def resume(self) -> None:
        """Let the thread run until it waits or ends, or the last one does that it and its successors hand over to."""
        self._returns_to = self._back
        self._node_ident = get_ident()
        seen, shown = (self, self._turns + 1), None
        self._begin_turn()
        is_back = pass_on(self._go, self._back, PATIENCE_S)         # a watchdog can interrupt the wait
        while not is_back:
            turn = self._turn_under_way()
            if turn == seen != shown:
                turn[0]._show()
                shown = turn
            seen = turn
            is_back = self._back.take(PATIENCE_S)

    def abandon(self) -> bool:
        """End the thread; its `finally` blocks run. Returns False if it does not end; it is never resumed again."""
        self._abandoned = True
        self._back = Baton()            # a run broken off within `resume` may still give the one before
        self._returns_to = self._back
        for _ in range(LAST_CALLS):
            if self.waiting:
                self._go.give()
            else:                       # it was computing when the run was broken off
                ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(self._ident), ctypes.py_object(Abandoned))
            if not self._back.take(PATIENCE_S) or self.ended:
                break
        return self.ended

    def _begin_turn(self) -> None:
        """Note that this thread runs from now on; the caller gives it the baton."""
        self.waiting, self._next = False, None
        self._turns += 1
        STANDS_IN[self._node_ident] = self._ident

    def _turn_under_way(self) -> tuple[ProgramThread, int]:
        """Return the last of the threads that this one and its successors have handed over to, and its turn."""
        thread = self
        while thread._next is not None:
            thread = thread._next
        return thread, thread._turns

    def _show(self) -> None:
        frame = sys._current_frames().get(self._ident)
        where = "".join(traceback.format_stack(frame)) if frame is not None else "at its start"
        print(f"{self.name} has been computing for {PATIENCE_S:g} s without waiting for anything; it is here:\n{where}",
              file=sys.stderr, flush=True)

    # --- in its own thread

    def live(self, function: Callable[[], object]) -> None:
        """Run `function` from the first resume to its end; the target of the OS thread."""
        self._ident = get_ident()
        self._go.take()
        try:
            if not self._abandoned:
                function()
        except Abandoned:
            pass
        except BaseException as error:
            self.failure = error
        finally:
            self.ended = True
            del self._go                # which closes the file of an EventBaton
            self._returns_to.give()

    def suspend(self) -> None:
        """Let the node's thread run; returns when this one is to run again, and raises Abandoned if it has to end."""
        pass_on(self._returns_to, self._go)
        if self._abandoned:
            raise Abandoned

    def suspend_for(self, other: ProgramThread) -> None:
        """Let `other`, which waits, run in place of this thread; otherwise as `suspend`."""
        other._returns_to, other._node_ident = self._returns_to, self._node_ident
        other._next = None              # first, so that the successors never form a circle
        self._next = other
        other._begin_turn()
        pass_on(other._go, self._go)
        if self._abandoned:
            raise Abandoned
