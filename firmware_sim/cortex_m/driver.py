"""Runs a machine in the virtual time of its node: what happens to the board goes in, what the program asks for out.

If computing takes no time, all that a wake-up does happens at its instant. Otherwise the driver runs the machine ahead
of the node, to the first instruction that asks for something outside, and carries that out when the node's time has
come to it. What happens to the board before, an interrupt, undoes this: the machine goes back to the snapshot that was
taken where the run ahead began, and runs to the first instruction boundary at or after the interrupt's instant.

*Invariants*
- between the snapshot and the present state of the machine it asks for nothing: running that again is the same;
- the machine is at most `AHEAD_NS` ahead of its node;
- an alarm of the past (`_generation`) acts no more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, Final, Protocol

from firmware_sim.cortex_m.errors import MachineFault, ProgramEnds
from firmware_sim.cortex_m.fault import describe
from firmware_sim.cortex_m.image import Image
from firmware_sim.cortex_m.machine import (
    COMMANDS_NOTED,
    COUNT,
    LOCAL_NS,
    NEVER,
    NEXT_TICK_NS,
    OTHERS,
    PORT_WAKES,
    STATUS,
    TIMER_WAKES,
    WAKERS,
    Ask,
    Call,
    Machine,
    Stop,
)
from firmware_sim.cortex_m.processor_records import ProcessorRecords, Records
from netem.wire.level import Level

AHEAD_NS: Final = 10_000_000
NO_VALUE: Final = -4                # BoardError of marconet_board.h
WATCHDOG_RESET: Final = 1
SOFTWARE_RESET: Final = 2
HAND_OVER: Final = int(Ask.HAND_OVER)
SLEEPS: Final = int(Stop.SLEEPS)    # plain numbers: to look up members of an enumeration takes longer than to compare


class Outside(Protocol):
    """The world outside the machine: the program of its board."""

    def carry_out(self, calls: Iterable[Call]) -> None:
        """Do them, each an Ask up to MISTAKE; `place` is that of the first byte in `machine.bytes`, or has the flags
        of a timer."""
    def record(self, signal: int, value: float) -> None:
        """Let the signal have the value from now on."""
    def drive(self, stage: int, share: float) -> None:
        """Let a PWM stage have this share of its full scale as mean output."""
    def answer(self, ask: int, number: int, integer: int, real: float) -> float | None:
        """Return the answer, None for BOARD_NO_VALUE."""
    def timers_armed(self) -> bool:
        """Whether any timer is armed."""
    def disarm_all(self) -> None:
        """Disarm all timers, as the machine is reset."""


class Processor(Records, Protocol):
    """The part of `Board` that the driver uses: instants [ns], timers by true time, records, faults."""

    name: str

    @property
    def now_ns(self) -> int: ...
    def clock_reading(self) -> Callable[[], int]: ...
    @property
    def slowness(self) -> float: ...
    def after(self, delay_ns: int, action: Callable[[], object], *, sends: bool = True) -> None: ...
    def when_slowed(self, action: Callable[[], object]) -> None: ...
    def event(self, kind: str, detail: str = "", level: Level = Level.INFO) -> None: ...


class Driver:
    """`budget`: instructions after which a program that does not sleep counts as an endless loop, 0 for no limit."""

    def __init__(self, machine: Machine, image: Image, board: Processor, outside: Outside, timed: bool,
                 budget: int, remedy: str) -> None:
        """`budget`: instructions after which a program that has not slept is in an endless loop, whose message ends
        with `remedy`; 0: no limit."""
        self.machine, self._image, self._board, self._outside = machine, image, board, outside
        self._timed, self._budget, self._remedy = timed, budget, remedy
        self._generation = 0            # of the alarm that acts
        self._waits_for_tick = False    # one is armed
        self._ahead_to_ns = -1          # where the run ahead ended, -1: the machine is not ahead
        self._stop = int(Stop.SLEEPS)   # why it ended there
        self._woke_at = 0               # count of instructions at the last wake-up
        self._records = ProcessorRecords(board, machine, image, timed, self._catch_up)
        self._fed = 0                   # times that the watchdog was written
        self._watched = False           # it runs
        self._sleeps_for_ever = False   # that was told
        self._error: BaseException | None = None        # of `_answer`
        self._present_ns, self._local_ns = board.present_ns, board.clock_reading()
        self._run_frame, self._run_ring, self._instructions = machine.run_frame, machine.run_ring, budget or NEVER
        if timed:
            board.when_slowed(self._slow_down)
        self._by_blocks = not timed and machine.run_by_blocks(self._answer)

    def start(self) -> None:
        """Run the program from its reset until it sleeps or, if computing takes time, for the present instant."""
        self.machine.reset(self._board.present_ns())
        if self._timed and self._board.slowness != 1.0:
            self.machine.slow_down(self._board.slowness)
        self._happen(_nothing)

    def receive(self, port: int, data: bytes) -> None:
        """A frame has arrived."""
        if not self._by_blocks:
            self._happen(partial(self.machine.receive, port, data))
        else:
            self._finish(self._run_frame(self._present_ns(), self._local_ns(), self._instructions, port, data,
                                         len(data)))

    def ring(self, channel: int) -> None:
        """A channel of the timer is due."""
        if not self._by_blocks:
            self._happen(partial(self.machine.ring, channel))
        else:
            self._finish(self._run_ring(self._present_ns(), self._local_ns(), self._instructions, channel))

    # --- the machine and the node's time

    def _happen(self, event: Callable[[], object]) -> None:
        """Let something happen to the board, now."""
        machine, now_ns = self.machine, self._board.present_ns()
        if 0 <= self._ahead_to_ns <= now_ns:
            self._settle()
        elif self._ahead_to_ns > now_ns:
            machine.restore()
            machine.run(now_ns)
        self._ahead_to_ns = -1
        self._records.settled()
        self._records.wakes()
        machine.at(now_ns, self._board.now_ns)
        event()
        self._go_on()

    def _catch_up(self) -> None:
        """Settle that the processor fell asleep, of which no alarm tells."""
        if 0 <= self._ahead_to_ns <= self._board.present_ns() and self._stop == SLEEPS:
            self._settle()
            self._records.settled()

    def _slow_down(self) -> None:
        """A fault that slows the processor down begins or ends."""
        self._happen(lambda: self.machine.slow_down(self._board.slowness))

    def _go_on(self) -> None:
        machine, now_ns = self.machine, self._board.present_ns()
        if not self._timed:
            self._finish(machine.run(NEVER, self._limit()))
            return
        while True:
            machine.save()
            stop = machine.run(now_ns + AHEAD_NS, self._limit())
            reached_ns = machine.now_ns
            self._stop, self._ahead_to_ns = stop, reached_ns
            if reached_ns > now_ns:
                self._wake(machine.next_tick_ns if stop == SLEEPS else reached_ns)
                return
            self._ahead_to_ns = -1
            if self._rests(machine.settle(stop)):
                return

    def _finish(self, stop: int) -> None:
        """Let the machine, whose computing takes no time, go on until it sleeps."""
        machine = self.machine
        while True:
            if self._error is not None:
                error, self._error = self._error, None
                raise error
            if machine.numbers[COMMANDS_NOTED]:
                self._carry_out()
            if stop == SLEEPS:
                break
            if stop != Stop.HAS_COMMANDS:
                self._end(stop)
            stop = machine.run(NEVER, self._limit())
        times = machine.times
        self._woke_at = times[COUNT]
        if times[NEXT_TICK_NS] < NEVER or self._waits_for_tick:
            self._wake(times[NEXT_TICK_NS])
        elif not machine.numbers[WAKERS] & PORT_WAKES:
            self._check_that_something_wakes()

    def _limit(self) -> int:
        return self._woke_at + self._budget if self._budget else NEVER

    def _rests(self, stop: int) -> bool:
        """Carry out what the machine, which stopped at the present, asks for; return whether it sleeps."""
        machine = self.machine
        self._carry_out()
        if stop == SLEEPS:
            self._woke_at = machine.count
            self._records.settled()
            self._records.sleeps(self._board.present_ns())
            self._wake(machine.next_tick_ns)
            return True
        if stop != Stop.HAS_COMMANDS:
            self._end(stop)
        return False

    def _settle(self) -> None:
        """Do what the machine, which ran ahead to the present, asks for there."""
        stop, reached_ns, self._ahead_to_ns = self.machine.settle(self._stop), self._ahead_to_ns, -1
        self._carry_out()
        if stop == Stop.SLEEPS:
            self._woke_at = self.machine.count
            self._records.sleeps(reached_ns)
        elif stop == Stop.LOCKED_UP or (stop == Stop.REACHED_LIMIT and self._budget
                                        and self.machine.count >= self._woke_at + self._budget):
            self._end(stop)

    def _wake(self, at_ns: int) -> None:
        """Go on at `at_ns` unless something happens before."""
        self._generation += 1
        self._waits_for_tick = at_ns < NEVER
        if self._waits_for_tick:
            self._board.after(max(0, at_ns - self._board.present_ns()), partial(self._alarm, self._generation))
        elif not self.machine.numbers[WAKERS] & PORT_WAKES:
            self._check_that_something_wakes()

    def _check_that_something_wakes(self) -> None:
        """Tell once if the program sleeps, with SysTick and the interrupts of ports off, and no timer can wake it."""
        if self._sleeps_for_ever or self._watched:
            return
        armed = self._outside.timers_armed()
        if not (armed and self.machine.numbers[WAKERS] & TIMER_WAKES):
            self._sleeps_for_ever = True
            timer = "the interrupt of the timer is off" if armed else "no timer is armed"
            self._board.event("sleeps for ever", f"SysTick is off, no port's interrupt is on, and {timer}: let one of "
                              f"them wake it; {describe(self.machine.fault(), self._image, 'last')}", Level.ERROR)

    def _alarm(self, generation: int) -> None:
        if generation == self._generation:
            self._happen(_nothing)

    def _answer(self, ask: int, number: int, integer: int, real: float) -> float:
        """Answer a program that waits; an error is kept until the machine stops."""
        value, machine = None, self.machine
        if self._error is None:
            try:
                if machine.numbers[COMMANDS_NOTED]:
                    self._carry_out()
                if ask != HAND_OVER:
                    value = self._outside.answer(ask, number, integer, real)
            except BaseException as error:
                self._error = error
        machine.numbers[STATUS] = NO_VALUE if value is None else 0
        machine.times[LOCAL_NS] = self._local_ns()
        return 0.0 if value is None else value

    def _carry_out(self) -> None:
        machine, outside = self.machine, self._outside
        if not machine.numbers[OTHERS]:
            outside.carry_out(machine.commands())
            return
        for call in machine.commands():
            ask, number, integer, _, real = call
            if ask <= Ask.MISTAKE:
                outside.carry_out((call,))
            elif ask == Ask.RECORD:
                outside.record(number, real)
            elif ask == Ask.DRIVE:
                outside.drive(number, real)
            elif ask >= Ask.ADJUST_CLOCK:
                value = outside.answer(ask, number, integer, real)
                machine.answer(ask, NO_VALUE if value is None else 0, value or 0.0, self._board.now_ns)
            elif ask == Ask.CAPTURE:
                machine.answer(ask, 0, 0.0, self._board.now_ns)
            elif ask == Ask.WATCHDOG:
                self._feed(integer)
            elif ask == Ask.RESTART:
                self._reset(SOFTWARE_RESET)
                return
            else:
                raise ProgramEnds(number, f"{self._board.name}: its program ended the run with code {number} (register "
                                  f"RUN_END), {describe(machine.fault(), self._image, 'last')}")

    def _feed(self, delay_us: int) -> None:
        self._fed += 1
        self._watched = delay_us > 0
        if delay_us:
            self._board.after(delay_us * 1000, partial(self._bite, self._fed))

    def _bite(self, fed: int) -> None:
        if fed == self._fed:
            self._board.count("watchdog resets")
            self._ahead_to_ns = -1
            self._reset(WATCHDOG_RESET)
            self._happen(_nothing)

    def _reset(self, cause: int) -> None:
        self._fed += 1
        self._watched = self._sleeps_for_ever = False
        self._outside.disarm_all()
        self.machine.reset(self._board.present_ns(), cause)
        self.machine.at(self._board.present_ns(), self._board.now_ns)
        self._woke_at = self.machine.count

    def _end(self, stop: int) -> None:
        fault = self.machine.fault()
        if stop == Stop.REACHED_LIMIT:
            raise MachineFault(f"{self._board.name}: endless loop: {self._budget} instructions without sleeping, "
                               f"{describe(fault, self._image, 'the last')}; {self._remedy}")
        raise MachineFault(f"{self._board.name}: {describe(fault, self._image)}")


def _nothing() -> Any:
    return None
