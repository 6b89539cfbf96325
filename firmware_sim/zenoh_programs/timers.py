"""Actions of the library at later instants, in one thread of the program."""

from __future__ import annotations

import threading
from collections.abc import Callable
from heapq import heappop, heappush
from itertools import count

from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.blocking.program_thread import ProgramThread
from netem.wire.instants import NEVER_NS


class Timers:
    def __init__(self, program: BlockingProgram) -> None:
        self._program = program
        self._waiting: list[tuple[int, int, Callable[[], object]]] = []
        self._order = count()
        self._thread: ProgramThread | None = None
        threading.Thread(target=self._run, name="zenoh timers", daemon=True).start()

    def after(self, delay_ns: int, action: Callable[[], object]) -> None:
        """Call `action` after `delay_ns` of the node's oscillator; it must not wait."""
        heappush(self._waiting, (self._program.due_ns(max(0, delay_ns)), next(self._order), action))
        if self._thread is not None:
            self._program.wake(self._thread)

    def _run(self) -> None:
        program = self._program
        self._thread = program.thread()
        while True:
            while self._waiting and self._waiting[0][0] <= program.node.now_ns:
                heappop(self._waiting)[2]()
            program.wait(self._waiting[0][0] if self._waiting else NEVER_NS)
