"""Called by the node's thread: `resume` runs a thread of a program until it suspends, `abandon` ends it.

Not compiled: in a run outside the main thread a watchdog ends the run by an exception, which is raised in `resume`
between two waits; compiled code would not look for it.
"""

from __future__ import annotations

import ctypes
import sys
import traceback
from _thread import get_ident  # the real one, whatever `library_time` puts into `threading`
from typing import Final

from firmware_sim.blocking.batons import Baton, pass_on
from firmware_sim.blocking.program_thread import Abandoned, ProgramThread
from netem.node.turn import STANDS_IN

PATIENCE_S: Final = 2.0         # wall clock; a thread that computes for longer is shown once in the node's log
LAST_CALLS: Final = 10          # how often Abandoned is raised in a thread before `abandon` gives up


def resume(thread: ProgramThread) -> None:
    """Let the thread run; returns when it, or the last thread of the chain of its handovers, waits or ends."""
    thread.returns_to = back = thread.back
    thread.node_ident = get_ident()
    try:
        thread.begin_turn()
        seen, shown = (thread, thread.turns), None
        is_back = pass_on(thread.go, back, PATIENCE_S)          # a watchdog can interrupt the wait
        while not is_back:
            turn = thread.turn_under_way()
            if turn == seen != shown:
                _show(turn[0])
                shown = turn
            seen = turn
            is_back = back.take(PATIENCE_S)
    finally:
        STANDS_IN.pop(thread.node_ident, None)


def abandon(thread: ProgramThread) -> bool:
    """End the thread; its `finally` blocks run. Returns False if it does not end; it is never resumed again."""
    thread.abandoned = True
    thread.back = thread.returns_to = Baton()       # a thread of a broken-off run may still give the old one
    for _ in range(LAST_CALLS):
        if thread.waiting:
            thread.go.give()
        else:                       # it was computing when the run was broken off
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread.ident), ctypes.py_object(Abandoned))
        if not thread.back.take(PATIENCE_S) or thread.ended:
            break
    STANDS_IN.pop(get_ident(), None)        # a handover after the run was broken off has noted a thread again
    return thread.ended


def _show(thread: ProgramThread) -> None:
    frame = sys._current_frames().get(thread.ident)
    where = "".join(traceback.format_stack(frame)) if frame is not None else "at its start"
    print(f"{thread.name} has been computing for {PATIENCE_S:g} s without waiting for anything; it is here:\n{where}",
          file=sys.stderr, flush=True)
