"""Ends an inline run in which a node's code does not return, with the same message as a run with processes.

    2 s without a step         `waiting` is called, again and again
    the time-out               NodeHangs is raised in the node's code; the run fails as for any other error of a program
    1 s, 2 s after it          NodeHangs is raised again, in case the code has caught it
    3 s after it               the process ends with code 3: the code is in a call into C that lets other threads run
    5 s after it               Python's fault handler writes the stacks and ends the process: no other thread can run

The last two leave the records on the disk unfinished; the message goes to the standard error or, if another process
reads `UnderWay`, behind its memory. They need the main thread: a run in another thread is interrupted between two
bytecodes only.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from types import FrameType
from typing import Any, Final, NoReturn

from netem.node.turn import STANDS_IN, Turn
from netem.transport.diagnosis import words
from netem.transport.diagnosis.stack import Frame, as_traceback, frames_to_show
from netem.transport.diagnosis.under_way import UnderWay

LOOK_EVERY_S: Final = 0.25
WAITING_AFTER_S: Final = 2.0
RAISE_AGAIN_S: Final = 1.0
END_AFTER_S: Final = 3.0
FAULT_AFTER_S: Final = 5.0
RENEW_S: Final = 1.0
JOIN_S: Final = 1.0
RAISE_SIGNAL: Final = signal.SIGRTMAX - 6
NODE_FAILED: Final = 3                      # exit code
MARK: Final = "marconet: "                  # begins the message behind the memory of `UnderWay`


class NodeHangs(BaseException):
    """Raised in the code of a node that does not return; no Exception, so that few programs catch it."""


class Watchdog:
    """`turn.steps` grows with every window. Word 0 of `under_way` is the place in `nodes` of the node whose code runs,
    counted from 1; it is 0 between nodes.
    """

    def __init__(self, nodes: Sequence[str], under_way: UnderWay, timeout_s: float,
                 waiting: Callable[[Sequence[str], float], None], turn: Turn) -> None:
        self._nodes = list(nodes)
        self._under_way = under_way
        self._timeout_s = timeout_s
        self._waiting = waiting
        self._over = threading.Event()
        self._watched = threading.get_ident()
        self._in_main = threading.current_thread() is threading.main_thread()
        self._handler: Any = None
        self._thread: threading.Thread | None = None
        self._armed_s = 0.0
        self._turn = turn
        self.reason = ""                    # of the NodeHangs that was raised
        self.detail = ""

    def start(self) -> None:
        if self._in_main:
            self._handler = signal.signal(RAISE_SIGNAL, self._raise)
            self._renew()
        self._thread = threading.Thread(target=self._watch, name="node watchdog", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        self._over.set()
        if self._thread is not None:
            self._thread.join(JOIN_S)       # so that nothing of the run is in use any more
        if self._in_main and self._handler is not None:
            faulthandler.cancel_dump_traceback_later()
            signal.signal(RAISE_SIGNAL, self._handler)
            self._handler = None

    def _watch(self) -> None:
        seen, since_s, raised_s, told_s = (self._turn.steps, 0), time.monotonic(), 0.0, 0.0
        while not self._over.wait(LOOK_EVERY_S):
            now_s = time.monotonic()
            place = self._under_way.words[0]
            if (self._turn.steps, place) != seen or not 0 < place <= len(self._nodes) or self._under_way.held():
                seen, since_s, raised_s = (self._turn.steps, place), now_s, 0.0
                if self._in_main and now_s - self._armed_s > RENEW_S:
                    self._renew()
                continue
            waited_s = now_s - since_s
            if waited_s > self._timeout_s + END_AFTER_S and self._in_main:
                self._end(self._nodes[place - 1])
            elif waited_s > self._timeout_s:
                if now_s - raised_s > RAISE_AGAIN_S:
                    self._interrupt()
                    raised_s = now_s
            elif waited_s > WAITING_AFTER_S and now_s - told_s > WAITING_AFTER_S / 4:
                told_s = now_s
                self._waiting([self._nodes[place - 1]], waited_s)

    def _renew(self) -> None:
        """Postpone the end by the fault handler, whose thread needs no interpreter, so that no code can delay it."""
        self._armed_s = time.monotonic()
        faulthandler.dump_traceback_later(self._timeout_s + FAULT_AFTER_S, exit=True, file=self._fault_file())

    def _fault_file(self) -> int:
        return self._under_way.file if self._under_way.shared else 2

    def _note_stack(self) -> None:
        """Keep the stack of the node's code in `reason` and `detail`."""
        stacks = sys._current_frames()
        frame = stacks.get(STANDS_IN.get(self._watched, self._watched), stacks.get(self._watched))
        frames = [Frame(found.filename, found.lineno or 0, found.name)
                  for found in reversed(traceback.extract_stack(frame))]
        self.reason = words.hangs("no answer", self._timeout_s, self._under_way, frames=frames,
                                  starting=self._turn.steps < len(self._nodes))      # one step builds one node
        self.detail = as_traceback(frames)

    def _interrupt(self) -> None:
        self._note_stack()
        if self._in_main:
            signal.pthread_kill(self._watched, RAISE_SIGNAL)        # also ends a sleep
        else:
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(self._watched), ctypes.py_object(NodeHangs))

    def _end(self, node: str) -> NoReturn:
        self._note_stack()
        what = f"node {node}: {self.reason}\n{self.detail}"
        if self._under_way.shared:
            os.write(self._under_way.file, f"{MARK}{what}".encode(errors="replace"))
        else:
            os.write(2, f"\n{what}".encode(errors="replace"))
        os._exit(NODE_FAILED)

    def _raise(self, number: int, frame: FrameType | None) -> None:
        if self._under_way.words[0]:                # 0 if the code has returned in the meantime
            raise NodeHangs


def last_words(status: int, nodes: Sequence[str], under_way: UnderWay, timeout_s: float) -> tuple[str, str, str]:
    """Return (node, what happened, stack) for the process of an inline run that ended without reporting an error.

    `status` is its exit code, -N for signal N; `node` is "" if no node's code ran.
    """
    place = under_way.running()
    node = nodes[place - 1] if 0 < place <= len(nodes) else ""
    written = under_way.stacks()
    if MARK in written:
        what, _, stack = written.rpartition(MARK)[2].partition("\n")
        return node, what.removeprefix(f"node {node}: "), stack
    if "Timeout (" in written:              # the fault handler's own end
        frames = frames_to_show(written)
        return node, words.hangs("no answer", timeout_s, under_way, frames=frames), as_traceback(frames)
    return node, f"its process {words.ended(status, under_way)}", words.stack(under_way)

