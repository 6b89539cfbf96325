"""The history of a machine, with which a debugger steps back: from a checkpoint the machine runs once more.

    checkpoint, run to n1, ring(3), run to n2, answer(...), run to n3        the present
    go_to(n): return to the last checkpoint at or before n, do all again up to the n-th instruction

The history holds the board's answers to what the program asked (sensors, random numbers), so a machine that runs once
more asks nothing of the board. gdb may read a machine that was taken back, and not write it.

Invariants:
- entries are what reached the machine, in order; a `Ran` ends at the count of instructions where the next one begins;
- checkpoints are taken between entries or, `_near`, within a `Ran`; entries before the first are forgotten.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from firmware_sim.cortex_m.gdb.target import Target
from firmware_sim.cortex_m.machine import NEVER, Stop

CHECKPOINTS: Final = 16             # kept, of 0.3 MB each
CHECK_EVERY: Final = 1_000_000      # instructions
CHECK_EVERY_ENTRIES: Final = 20_000
NEAR: Final = 2_000                 # instructions before a place that was gone to: another step back is quick
IT_BLOCK: Final = 4                 # instructions that the machine does not stop between


class Ran(NamedTuple):
    until_ns: int
    end: int                        # count of instructions


class Checkpoint(NamedTuple):
    handle: int
    entry: int                      # number of the entry that comes next
    instructions: int               # that the machine had executed


class History:
    """`run(until_ns, budget)` runs the machine, `count` returns its instructions so far."""

    def __init__(self, target: Target, run: Callable[[int, int], int], count: Callable[[], int]) -> None:
        self._target, self._run, self._count = target, run, count
        self._entries: list[Ran | Callable[[], object]] = []
        self._forgotten = 0                     # entries before the first one kept
        self._checkpoints: list[Checkpoint] = []
        self._near: Checkpoint | None = None
        self._cursor = 0                        # number of the entry that comes next, or is partly done
        self.is_past = False                    # the machine was taken back, and is not at the present again

    def note(self, happening: Callable[[], object]) -> None:
        """Note a call of the driver or gdb to the machine, to be made again when the machine is taken back."""
        self._entries.append(happening)

    def ran(self, until_ns: int, end: int) -> None:
        """Note that the machine has run up to the instruction `end`."""
        begun = bool(self._checkpoints) and self._checkpoints[-1].entry - self._forgotten < len(self._entries)
        if begun and (last := self._entries[-1]) and isinstance(last, Ran) and last.until_ns == until_ns:
            self._entries[-1] = Ran(until_ns, end)
        else:
            self._entries.append(Ran(until_ns, end))

    def keep_checkpoint(self) -> None:
        """Take a checkpoint of the present if the last is long past."""
        here, count = self._forgotten + len(self._entries), self._count()
        last = self._checkpoints[-1] if self._checkpoints else None
        if last is not None and count - last.instructions < CHECK_EVERY and here - last.entry < CHECK_EVERY_ENTRIES:
            return
        self._checkpoints.append(Checkpoint(self._target.checkpoint(), here, count))
        if len(self._checkpoints) > CHECKPOINTS:
            self._target.free(self._checkpoints.pop(0).handle)
            first = self._checkpoints[0].entry
            del self._entries[:first - self._forgotten]
            self._forgotten = first
            self._forget_near()

    def back(self) -> bool:
        """Go back one instruction, or to the beginning of the history and return False."""
        now = self._count()
        for to in range(now - 1, now - 1 - IT_BLOCK, -1):
            if not self._go_to(to):
                break
            if self._count() < now:
                return True
        self._go_to(self._checkpoints[0].instructions)
        return False

    def back_to_breakpoint(self) -> bool:
        """Go back to the last breakpoint, or to the beginning of the history and return False."""
        end = self._count()
        for checkpoint in reversed(self._checkpoints):
            if checkpoint.instructions >= end:
                continue
            self._return_to(checkpoint)
            found = -1
            while self._count() < end and self._forward(end, heed=True):
                found = self._count()
                self._forward(found + 1)
            if found >= 0:
                self._go_to(found)
                return True
            end = checkpoint.instructions
        self._go_to(self._checkpoints[0].instructions)
        return False

    def step(self) -> None:
        """In the past, do the next instruction again."""
        self._forward(self._count() + 1)

    def on(self) -> bool:
        """In the past, go on to the next breakpoint, or to the present and return False."""
        self._forward(self._count() + 1)
        return self.is_past and self._forward(NEVER, heed=True)

    def to_present(self) -> None:
        if self.is_past:
            self._forward(NEVER)

    def close(self) -> None:
        for checkpoint in self._checkpoints:
            self._target.free(checkpoint.handle)
        self._checkpoints.clear()
        self._forget_near()

    def _go_to(self, count: int) -> bool:
        """Go to the last state in which `count` instructions have run, before the next; False if that is forgotten."""
        if count < self._checkpoints[0].instructions:
            return False
        known = [*self._checkpoints, *([] if self._near is None else [self._near])]
        self._return_to(max((checkpoint for checkpoint in known if checkpoint.instructions <= count),
                            key=lambda checkpoint: (checkpoint.instructions, checkpoint.entry)))
        if count - self._count() > NEAR:
            self._forward(count - NEAR)
            self._forget_near()
            self._near = Checkpoint(self._target.checkpoint(), self._cursor, self._count())
        self._forward(count)
        return True

    def _return_to(self, checkpoint: Checkpoint) -> None:
        self._target.return_to(checkpoint.handle)
        self._cursor, self.is_past = checkpoint.entry, True

    def _forward(self, to: int, heed: bool = False) -> bool:
        """Do again what comes next until `to` instructions have run, or all; True at a heeded breakpoint."""
        self._target.heed_breakpoints(heed)
        while self._cursor < self._forgotten + len(self._entries):
            entry = self._entries[self._cursor - self._forgotten]
            if not isinstance(entry, Ran):
                entry()
            else:
                if self._run_again(entry.until_ns, min(entry.end, to)) == Stop.HALTED:
                    return True
                if to < entry.end:
                    return False
            self._cursor += 1
        self.is_past = False
        return False

    def _run_again(self, until_ns: int, end: int) -> int:
        while True:                     # entries of exceptions take some of the budget
            stop = self._run(until_ns, end)
            if stop != Stop.REACHED_LIMIT or self._count() >= end:
                return stop

    def _forget_near(self) -> None:
        if self._near is not None:
            self._target.free(self._near.handle)
            self._near = None
