"""A machine that a debugger holds: it runs only as far as gdb lets it, and can be taken back.

    the driver's run(until) --> stands still: gdb's packets --> one instruction, or up to a breakpoint --> ...

If computing takes time, the driver runs the machine ahead of the node and may take that back. Nothing is shown to gdb
then: the debugger sees the instructions when the node's time has come to them, in `settle` or in the run after
`restore`, where they are run again from the driver's snapshot.

Invariants:
- where gdb sees the machine stand still, the board has answered what the program has asked, and will not take it back;
- when `run` returns to the driver, the machine is at its present.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Final, Protocol

from firmware_sim.cortex_m.gdb.commands import Go, Resume, answer
from firmware_sim.cortex_m.gdb.history import History
from firmware_sim.cortex_m.gdb.listener import accept
from firmware_sim.cortex_m.gdb.target import Target
from firmware_sim.cortex_m.gdb.wire import INTERRUPT, Wire
from firmware_sim.cortex_m.machine import (
    COMMANDS_NOTED,
    NEVER,
    NEXT_TICK_NS,
    OTHERS,
    PORT_WAKES,
    WAKERS,
    Call,
    Machine,
    Stop,
)

SLICE: Final = 500_000                          # instructions between two looks for Ctrl-C
LOOK_EVERY_STEPS: Final = 64
TRAP, CTRL_C, SEGMENT, TIME_LIMIT = 5, 2, 11, 24        # gdb's numbers of signals
HELP: Final = "monitor time: virtual time of the program, and instructions that it has executed\n"


class Board(Protocol):
    """The methods of the robot's board that a debugged machine calls."""

    name: str
    debug_port: int

    def hold_time_outs(self, hold: bool) -> None: ...
    def end_run(self, because: str) -> None: ...
    def warn(self, kind: str, detail: str = "") -> None: ...


class DebuggedMachine(Machine):
    def __init__(self, board: Board, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._board = board
        self._target = Target(self._library, self._machine)
        self._history = History(self._target, super().run, lambda: self.count)
        self._wire: Wire | None = None
        self._resume: Resume | None = None      # None: the program stands still
        self._stopped = _signal(TRAP)           # why it does, as gdb is told
        self._asked = False                     # gdb waits to be told that
        self._resumed_at = -1                   # address of a breakpoint to be passed over, -1 for none
        self._told_end = False                  # gdb has been told that the program cannot go on
        self._written = False                   # by the debugger
        self._gone = self._ended = False        # the debugger has left, or has ended the run
        self._ahead: tuple[int, int] | None = None      # the driver's arguments of a run ahead
        self._ahead_end = 0                     # count of instructions where that ended

    # --- for gdb's packets

    def registers(self) -> bytes:
        return self._target.registers()

    def read_memory(self, address: int, length: int) -> bytes:
        return self._target.read_memory(address, length)

    def write_register(self, number: int, value: bytes) -> bool:
        return self._write(partial(self._target.write_register, number, value))

    def write_memory(self, address: int, data: bytes) -> bool:
        return self._write(partial(self._target.write_memory, address, data))

    def set_breakpoint(self, address: int) -> bool:
        return self._target.set_breakpoint(address)

    def clear_breakpoint(self, address: int) -> None:
        self._target.clear_breakpoint(address)

    def _write(self, write: Callable[[], bool]) -> bool:
        if self._history.is_past or not write():
            return False
        self._history.note(write)
        if not self._written:
            self._written = True
            self._board.warn("changed by a debugger", "registers or memory were written: the run cannot be repeated "
                                                      "without it")
        return True

    def _monitor(self, words: str) -> str:
        if words.strip() != "time":
            return HELP
        return f"{self.now_ns / 1e9:.9f} s, {self.count} instructions\n"

    # --- what the driver does with a machine

    def run(self, until_ns: int = NEVER, budget: int = NEVER) -> int:
        if self._ended:
            return self._rest()
        if self._gone:
            return super().run(until_ns, budget)
        if self._ahead is not None:
            self._ahead = until_ns, budget
            self._target.heed_breakpoints(False)
            stop = super().run(until_ns, budget)
            self._ahead_end = self.count
            return stop
        return self._run_watched(until_ns, budget, budget)

    def settle(self, stop: int) -> int:
        if self._gone or self._ahead is None:
            self._ahead = None
            return stop
        until_ns, budget = self._ahead
        self.restore()
        return self._run_watched(until_ns, min(budget, self._ahead_end), budget)

    def save(self) -> None:
        super().save()
        self._ahead = NEVER, NEVER
        self._ahead_end = self.count

    def restore(self) -> None:
        super().restore()
        self._ahead = None

    def reset(self, time_ns: int, cause: int = 0) -> None:
        if self._ahead is not None:             # the watchdog bites while the machine is ahead
            self._history.ran(self._ahead[0], self._ahead_end)
            self._ahead = None
        self._happens(partial(super().reset, time_ns, cause))

    def at(self, time_ns: int, local_ns: int) -> None:
        self._happens(partial(super().at, time_ns, local_ns))

    def answer(self, kind: int, status: int, real: float, local_ns: int) -> None:
        self._happens(partial(super().answer, kind, status, real, local_ns))

    def receive(self, port: int, data: bytes) -> None:
        self._happens(partial(super().receive, port, data))

    def ring(self, channel: int) -> None:
        self._happens(partial(super().ring, channel))

    def set_cost(self, numerator: int, denominator: int) -> None:
        self._happens(partial(super().set_cost, numerator, denominator))

    def latency_ns(self) -> int:
        self._happens(super().latency_ns, now=False)
        return super().latency_ns()

    def commands(self) -> Iterator[Call]:
        self._happens(self._forget_commands, now=False)
        return super().commands()

    def run_by_blocks(self, answer: Callable[[int, int, int, float], float]) -> bool:
        return False

    def close(self) -> None:
        if self._machine:
            self._leave(b"W%02x" % (3 if self._told_end else 0))
            self._history.close()
        super().close()

    def _happens(self, happening: Callable[[], object], now: bool = True) -> None:
        if now:
            happening()
        if not self._gone:
            self._history.note(happening)

    def _forget_commands(self) -> None:
        self.numbers[COMMANDS_NOTED] = self.numbers[OTHERS] = 0

    def _rest(self) -> int:
        """Tell the driver that the machine sleeps until a frame comes, since the debugger has ended the run."""
        self.times[NEXT_TICK_NS], self.numbers[WAKERS] = NEVER, PORT_WAKES
        return int(Stop.SLEEPS)

    # --- under the debugger

    def _run_watched(self, until_ns: int, budget: int, limit: int) -> int:
        """Run as gdb wants it, up to `budget`; a program that comes to `limit` does not sleep."""
        self._history.keep_checkpoint()
        self._look()
        while not (self._gone or self._ended):
            if self._resume is None:
                self._serve()
                continue
            stop = self._advance(self._resume, until_ns, budget, limit)
            if stop is not None:
                return stop
        return self._rest() if self._ended else super().run(until_ns, budget)

    def _advance(self, resume: Resume, until_ns: int, budget: int, limit: int) -> int | None:
        """Run one instruction, or a slice of them; return what the driver has to act on, None for nothing."""
        count, pc, steps = self.count, self._target.pc(), resume.go is not Go.ON
        single = steps or pc == self._resumed_at
        self._resumed_at = -1
        self._target.heed_breakpoints(not single)
        stop = super().run(until_ns, min(budget, count + (1 if single else SLICE)))
        self._history.ran(until_ns, self.count)
        if stop == Stop.HALTED:
            self._stand(_signal(TRAP, b"swbreak:;"))
            return None
        over = self.now_ns >= until_ns
        if stop == Stop.LOCKED_UP or (stop == Stop.REACHED_LIMIT and self.count >= limit and not over):
            return self._cannot_go_on(stop)
        pc_now = self._target.pc()
        if steps and stop != Stop.SLEEPS and (self.count > count or pc_now != pc):
            self._after_step(resume, pc_now)
        if stop == Stop.REACHED_LIMIT and not over and self.count < budget:
            if not single or self.count % LOOK_EVERY_STEPS == 0:
                self._look()
            return None
        return stop

    def _after_step(self, resume: Resume, pc: int) -> None:
        if pc in self._target.breakpoints:
            self._stand(_signal(TRAP, b"swbreak:;"))
        elif not _goes_on(resume, pc):
            self._stand(_signal(TRAP))

    def _look(self) -> None:
        """Stand still if the user has pressed Ctrl-C; go on alone if the debugger is gone."""
        if self._wire is not None and self._resume is not None:
            if self._wire.interrupted():
                self._stand(_signal(CTRL_C))
            if self._wire.closed:
                self._leave(b"")

    def _cannot_go_on(self, stop: int) -> int | None:
        """Show the program once where it has locked up or used its budget; then the driver ends the node."""
        if self._told_end:
            return stop
        self._told_end = True
        self._stand(_signal(SEGMENT if stop == Stop.LOCKED_UP else TIME_LIMIT))
        return None

    def _stand(self, why: bytes) -> None:
        self._resume, self._stopped, self._asked = None, why, True

    def _serve(self) -> None:
        """Answer gdb until it lets the program go on, in the present; time-outs stand still meanwhile."""
        self._board.hold_time_outs(True)
        try:
            if self._wire is None:
                self._wire = accept(self._board.debug_port)
            wire = self._wire
            while self._resume is None and not (self._gone or self._ended):
                if self._asked:
                    wire.send(self._stopped)
                    self._asked = False
                packet = wire.receive()
                if not packet:
                    self._go(Resume(Go.ALONE))
                elif packet != INTERRUPT:
                    found = answer(packet, self, self._stopped, self._monitor)
                    if isinstance(found, Resume):
                        self._go(found)
                    else:
                        wire.send(found)
                        if packet == b"QStartNoAckMode":
                            wire.stop_acknowledging()
        finally:
            self._board.hold_time_outs(False)

    def _go(self, resume: Resume) -> None:
        history = self._history
        if resume.go is Go.ALONE:
            history.to_present()
            self._leave(b"OK")
        elif resume.go is Go.END:
            history.to_present()
            self._leave(b"OK")
            self._gone, self._ended = False, True
            self._board.end_run(f"the debugger of {self._board.name} ended it")
        elif resume.go is Go.BACK_STEP:
            self._stand(_signal(TRAP) if history.back() else _signal(TRAP, b"replaylog:begin;"))
        elif resume.go is Go.BACK_ON:
            self._stand(_signal(TRAP, b"swbreak:;" if history.back_to_breakpoint() else b"replaylog:begin;"))
        elif history.is_past:
            self._again(resume)
        else:
            self._resume, self._resumed_at = resume, self._target.pc()

    def _again(self, resume: Resume) -> None:
        """Go forward in the past; stand still at the present."""
        history = self._history
        if resume.go is Go.ON:
            halted = history.on()
            self._stand(_signal(TRAP, b"swbreak:;" if halted else b"replaylog:end;"))
            return
        history.step()
        while history.is_past and _goes_on(resume, pc := self._target.pc()) and pc not in self._target.breakpoints:
            history.step()
        self._stand(_signal(TRAP, b"" if history.is_past else b"replaylog:end;"))

    def _leave(self, words: bytes) -> None:
        """Send gdb `words` as the last packet, close the connection, and go on without a debugger."""
        self._gone, self._resume = True, None
        self._target.heed_breakpoints(False)
        for address in list(self._target.breakpoints):
            self._target.clear_breakpoint(address)
        if self._wire is not None:
            self._wire.send(words)
            self._wire.close()


def _goes_on(resume: Resume, pc: int) -> bool:
    return resume.go is Go.STEP_WITHIN and resume.first <= pc < resume.end


def _signal(number: int, why: bytes = b"") -> bytes:
    return b"T%02xthread:1;%b" % (number, why)
