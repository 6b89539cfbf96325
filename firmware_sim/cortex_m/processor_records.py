"""Writes load, interrupt latency and memory of an emulated processor into the records of the run.

Counters: instructions, flash bytes, RAM bytes, stack bytes and, if computing takes time, worst interrupt latency ns.
Signals, if computing takes time, each over the time since the sample before:

    processor_load      share of the time awake: instructions executed * duration of one / time
    interrupt_latency   longest time from an interrupt's instant to its entry [s]
    awake_time          longest time from a wake-up to the next sleep, or to the sample [s]
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, Protocol

from firmware_sim.cortex_m.image import Image
from firmware_sim.cortex_m.machine import Machine

SIGNALS: Final = (("processor_load", "1"), ("interrupt_latency", "s"), ("awake_time", "s"))


class Records(Protocol):
    """The part of `Board` that is used here."""

    def present_ns(self) -> int: ...
    def count(self, name: str, by: int = 1) -> None: ...
    def before_counters(self, action: Callable[[], object]) -> None: ...
    def record_all(self, signals_and_units: Sequence[tuple[str, str]], read: Callable[[], Sequence[float]]) -> None: ...


class ProcessorRecords:
    """`catch_up` lets the driver settle what the machine, which runs ahead, has done up to the present."""

    def __init__(self, board: Records, machine: Machine, image: Image, timed: bool,
                 catch_up: Callable[[], object]) -> None:
        self._board, self._machine, self._catch_up = board, machine, catch_up
        self._counted = 0               # instructions in the counter
        self._stack_bytes = 0
        self._worst_ns = 0              # interrupt latency so far
        self._latency_ns = 0            # since the last sample, as all below
        self._awake_ns = 0
        self._woke_ns = -1              # -1: it sleeps
        self._sampled_ns = board.present_ns()
        self._busy_ns = 0.0             # time that instructions took up to the last sample
        board.before_counters(self._last)
        machine.before_close = self._last
        board.count("flash bytes", image.flash_bytes)
        board.count("RAM bytes", image.ram_bytes)
        self._timed = timed
        if timed:
            board.count("worst interrupt latency ns", 0)
            board.record_all(SIGNALS, self._sample)

    def settled(self) -> None:
        """Count what the machine has done up to the present, which the driver will not take back."""
        machine, count = self._machine, self._machine.count
        self._board.count("instructions", count - self._counted)
        self._counted = count
        if (stack_bytes := machine.stack_bytes()) > self._stack_bytes:
            self._board.count("stack bytes", stack_bytes - self._stack_bytes)
            self._stack_bytes = stack_bytes
        if self._timed and (latency_ns := machine.latency_ns()):
            self._latency_ns = max(self._latency_ns, latency_ns)
            if latency_ns > self._worst_ns:
                self._board.count("worst interrupt latency ns", latency_ns - self._worst_ns)
                self._worst_ns = latency_ns

    def _last(self) -> None:
        """Count the last instructions, before the counters are read or the machine is closed."""
        if not self._machine.closed:
            self._catch_up()
            self.settled()

    def wakes(self) -> None:
        """Note that an interrupt wakes the processor now, unless it is awake."""
        if self._woke_ns < 0:
            self._woke_ns = self._board.present_ns()

    def sleeps(self, since_ns: int) -> None:
        """Note that the processor fell asleep at `since_ns`."""
        if self._woke_ns >= 0:
            self._awake_ns = max(self._awake_ns, since_ns - self._woke_ns)
            self._woke_ns = -1

    def _sample(self) -> tuple[float, float, float]:
        self._catch_up()
        now_ns = self._board.present_ns()
        busy_ns = self._machine.busy_ns_at(now_ns)
        awake_ns = max(self._awake_ns, now_ns - self._woke_ns if self._woke_ns >= 0 else 0)
        passed_ns = now_ns - self._sampled_ns
        values = ((busy_ns - self._busy_ns) / passed_ns if passed_ns else 0.0, self._latency_ns * 1e-9,
                  awake_ns * 1e-9)
        self._busy_ns, self._sampled_ns, self._latency_ns, self._awake_ns = busy_ns, now_ns, 0, 0
        return values
