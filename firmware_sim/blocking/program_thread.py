"""One thread of a blocking program: it runs only while it holds the baton, and gives it back when it waits.

    node's thread: resume() --baton--> program's thread: runs until it waits, ends or fails --baton--> resume() returns

Invariants:
- either the node's thread runs or one thread of the program, never two: between them nothing needs a lock;
- what is raised in the program's thread is kept in `failure`, for the node's thread to raise.
"""

from __future__ import annotations

import sys
import traceback
from _thread import allocate_lock, get_ident  # the real ones, whatever `library_time` puts into `threading`
from collections.abc import Callable
from threading import local
from typing import Final

from firmware_sim.blocking.calls_in_a_row import CallsInARow
from netem.wire.instants import NEVER_NS

PATIENCE_S: Final = 2.0         # wall clock; a thread that computes for longer is shown once in the node's log

LAST_CALLS: Final = 10          # that a thread which has to end may still try to wait in


class _OfThisThread(local):
    program: object = None      # the blocking program that the calling thread belongs to, see `here.py`


OF_THIS_THREAD: Final = _OfThisThread()


class Abandoned(SystemExit):
    """Raised within a thread that has to end now; as a SystemExit it is silent in `threading`."""


class ProgramThread:
    """`until_ns`, `hears`, `woken` and `alarm_ns` belong to the program, which says when the thread runs."""

    def __init__(self, name: str, *, daemon: bool) -> None:
        self.name = name
        self.daemon = daemon            # ends with the program's last thread that is no daemon
        self.waiting = True             # from its birth, until it is lent the baton for the first time
        self.woken = False
        self.hears = False              # it waits for frames, too
        self.until_ns = 0               # true time at which it goes on by itself
        self.alarm_ns = NEVER_NS        # the first event of the node that looks after it
        self.interrupted = False
        self.row = CallsInARow()
        self.joiners: list[ProgramThread] = []     # who waits for its end
        self.ended = False
        self.failure: BaseException | None = None
        self._abandoned = False
        self._ident = 0
        self._go, self._back = allocate_lock(), allocate_lock()
        self._go.acquire()
        self._back.acquire()

    # --- in the node's thread

    def resume(self) -> None:
        """Let the thread run until it waits or ends."""
        self.waiting = False
        self._go.release()
        if not self._back.acquire(timeout=PATIENCE_S):
            self._show()
            self._back.acquire()

    def abandon(self) -> bool:
        """End the thread: its `finally` blocks run. False if it will not; then it never gets the baton again."""
        self._abandoned = True
        for _ in range(LAST_CALLS):
            self._go.release()
            if not self._back.acquire(timeout=PATIENCE_S) or self.ended:
                break
        return self.ended

    def _show(self) -> None:
        frame = sys._current_frames().get(self._ident)
        where = "".join(traceback.format_stack(frame)) if frame is not None else "at its start"
        print(f"{self.name} has been computing for {PATIENCE_S:g} s without waiting for anything; it is here:\n{where}",
              file=sys.stderr, flush=True)

    # --- in its own thread

    def live(self, function: Callable[[], object]) -> None:
        """The whole life of the thread."""
        self._ident = get_ident()
        self._go.acquire()
        try:
            if not self._abandoned:
                function()
        except Abandoned:
            pass
        except BaseException as error:
            self.failure = error
        finally:
            self.ended = True
            self._back.release()

    def suspend(self) -> None:
        """Give the baton back; comes home when it is lent again."""
        self.waiting = True
        self._back.release()
        self._go.acquire()
        if self._abandoned:
            raise Abandoned
