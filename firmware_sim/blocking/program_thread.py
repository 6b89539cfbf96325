"""One thread of a blocking program: it runs only between `resume` (`resuming.py`) and `suspend`.

    node's thread: resume() --baton--> program's thread: runs until it waits, ends or fails --baton--> resume() returns
                                       suspend_for(next) --baton--> next: runs on --baton--> resume() returns

A thread that waits may hand over to another thread of its program, so that two changes of threads become one.

Invariants:
- either the node's thread or one thread of the program runs, never two, so their data needs no lock;
- an exception of the program's thread is kept in `failure`, and the node's thread raises it.
"""

from __future__ import annotations

from _thread import get_ident  # the real one, whatever `library_time` puts into `threading`
from collections.abc import Callable
from threading import local
from typing import Any, Final

from mypy_extensions import mypyc_attr

from firmware_sim.blocking.batons import Baton, EventBaton, pass_on
from firmware_sim.blocking.calls_in_a_row import CallsInARow
from netem.node.turn import STANDS_IN
from netem.wire.instants import NEVER_NS


@mypyc_attr(native_class=False)
class _OfThisThread(local):
    program: Any = None         # the blocking program that the calling thread belongs to, see `here.py`


OF_THIS_THREAD: Final = _OfThisThread()


@mypyc_attr(native_class=False)
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
        self.abandoned = False
        self.ident = 0
        self.go = EventBaton()
        self.back = Baton()
        self.returns_to = self.back         # what lets the node's thread go on
        self.next: ProgramThread | None = None      # the thread that it handed over to since it was resumed
        self.turns = 0                      # how often it was let go
        self.node_ident = 0                 # the thread that runs the node

    def begin_turn(self) -> None:
        """Note that this thread runs from now on; the caller gives it the baton `go`."""
        self.waiting, self.next = False, None
        self.turns += 1
        STANDS_IN[self.node_ident] = self.ident

    def turn_under_way(self) -> tuple[ProgramThread, int]:
        """Return the last of the threads that this one and its successors have handed over to, and its turn."""
        thread = self
        while thread.next is not None:
            thread = thread.next
        return thread, thread.turns

    # --- in its own thread

    def live(self, function: Callable[[], object]) -> None:
        """Run `function` from the first resume to its end; the target of the OS thread."""
        self.ident = get_ident()
        self.go.take()
        try:
            if not self.abandoned:
                function()
        except Abandoned:
            pass
        except BaseException as error:
            self.failure = error
        finally:
            self.ended = True
            self.go = Baton()           # an EventBaton has a file, which is closed with it
            self.returns_to.give()

    def suspend(self) -> None:
        """Let the node's thread run; returns when this one is to run again, and raises Abandoned if it has to end."""
        pass_on(self.returns_to, self.go)
        if self.abandoned:
            raise Abandoned

    def suspend_for(self, other: ProgramThread) -> None:
        """Let `other`, which waits, run in place of this thread; otherwise as `suspend`."""
        other.returns_to, other.node_ident = self.returns_to, self.node_ident
        other.next = None               # first, so that the successors never form a circle
        self.next = other
        other.begin_turn()
        pass_on(other.go, self.go)
        if self.abandoned:
            raise Abandoned
