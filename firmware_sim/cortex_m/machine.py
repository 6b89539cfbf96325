"""A machine from Python: the functions of its library (`machine.c`), bound once.

A machine runs until its program sleeps, asks for something outside (`commands`) or reaches a limit.
"""

from __future__ import annotations

import ctypes as c
import struct
from collections.abc import Callable, Iterator, Sequence
from enum import IntEnum
from fractions import Fraction
from functools import lru_cache, partial
from typing import Any, Final, NamedTuple

from firmware_sim.cortex_m.build import build_machine, unicorn_library
from firmware_sim.cortex_m.image import RAM, Image

COMMANDS: Final = 256               # as in machine.h, like all below
COMMAND_BYTES: Final = 16384
NEVER: Final = 2**63 - 1
_COMMAND: Final = struct.Struct("@IIqqd")
_REPORT_BYTES: Final = 40
COUNT: Final = 0                    # places in Machine.times
NEXT_TICK_NS: Final = 1
LOCAL_NS: Final = 2
COMMANDS_NOTED: Final = 0           # places in Machine.numbers
OTHERS: Final = 1                   # those from RECORD on, which are none of the host's operations
STATUS: Final = 2
WAKERS: Final = 3                   # bits: TIMER_WAKES, PORT_WAKES
TIMER_WAKES: Final = 1
PORT_WAKES: Final = 2
_ASK: Final = c.CFUNCTYPE(c.c_double, c.c_uint32, c.c_uint32, c.c_int64, c.c_double)


class Stop(IntEnum):
    SLEEPS = 0
    HAS_COMMANDS = 1
    REACHED_LIMIT = 2
    LOCKED_UP = 3
    HALTED = 5              # at a breakpoint


class Ask(IntEnum):
    """Kinds of requests that a program makes by its registers, and that the robot's board carries out."""

    SEND = 0
    SET_TIMER = 1
    SET_DELAY = 2
    CANCEL_TIMER = 3
    PROMISE = 4
    ACTUATE = 5
    COUNT = 6
    EVENT = 7
    MISTAKE = 8
    RECORD = 9
    DRIVE = 10
    WATCHDOG = 11
    CAPTURE = 12
    END = 13
    RESTART = 14
    ADJUST_CLOCK = 15
    SENSE = 16
    RANDOM = 17
    ENCODER = 18
    HAND_OVER = 19              # to `answer` of `run_by_blocks` only: carry out the commands so far


Call = tuple[int, int, int, int, float]         # Ask, id, integer, place, real, as those of a firmware on the host


class Fault(NamedTuple):
    """The last fault, or where the program is: registers are r0 to r12, sp, lr, pc, xpsr."""

    cause: int
    pc: int
    address: int
    registers: tuple[int, ...]


class Machine:
    """`cost`: cycles that an instruction takes; 0: computing takes no time."""

    def __init__(self, image: Image, clock_hz: int, cost: float, port_kinds: Sequence[int],
                 parameters: Sequence[Sequence[float]], unique_id: Sequence[int]) -> None:
        self._library = library = _library()
        self._cost = Fraction(10**9, clock_hz) * Fraction(str(cost))
        self._cost_ns = float(self._cost)               # while no fault slows the processor down
        self._busy_ns, self._busy_count = 0.0, 0        # time that this many instructions took
        tick, instruction = Fraction(10**9, clock_hz), self._cost
        self._machine = library.machine_new(tick.numerator, tick.denominator, instruction.numerator,
                                            instruction.denominator)
        if not self._machine:
            raise MemoryError("Unicorn could not make one more Cortex-M4")
        machine = self._machine
        for address, content in image.segments:
            library.machine_load(machine, address, content, len(content))
        library.machine_identify(machine, (c.c_uint32 * 4)(*unique_id))
        if not library.machine_declare_ram(machine, image.ram_end - RAM.start):
            raise MemoryError("Unicorn could not map the RAM of one more Cortex-M4")
        library.machine_stack(machine, image.stack_low, image.stack_top)
        library.machine_ports(machine, len(port_kinds), (c.c_uint32 * 8)(*port_kinds))
        ends = [0]
        for row in parameters:
            ends.append(ends[-1] + len(row))
        # kept, as the machine has their addresses
        self._values = (c.c_double * max(1, ends[-1]))(*(value for row in parameters for value in row))
        self._first = (c.c_uint32 * len(ends))(*ends)
        library.machine_parameters(machine, len(parameters), self._values, self._first)
        size = _COMMAND.size * COMMANDS
        self._commands = memoryview((c.c_char * size).from_address(library.machine_commands(machine))).cast("B")
        self.bytes = memoryview(            # of the commands, while the machine does not run
            (c.c_char * COMMAND_BYTES).from_address(library.machine_command_bytes(machine))).cast("B")
        report = memoryview((c.c_char * _REPORT_BYTES).from_address(library.machine_report(machine))).cast("B")
        self.times = report[:24].cast("q")              # at COUNT, NEXT_TICK_NS, LOCAL_NS
        self.numbers = report[24:].cast("i")            # at COMMANDS_NOTED, OTHERS, STATUS, WAKERS
        # at an instant and local time, so many instructions: a frame (port, data, length) or a ring (channel); a Stop
        self.run_frame: Callable[[int, int, int, int, bytes, int], int] = partial(library.machine_run_frame, machine)
        self.run_ring: Callable[[int, int, int, int], int] = partial(library.machine_run_ring, machine)
        self._ask: Any = None
        self.before_close: Callable[[], object] = lambda: None

    def run_by_blocks(self, answer: Callable[[int, int, int, float], float]) -> bool:
        """Count instructions by blocks of code and stop at their ends, not at exact instructions (decision 0056).

        Return whether it does: a machine that has to stop at exact ones refuses.

        For a machine that has not run and whose computing takes no time. `answer(ask, id, integer, real)` returns
        the answer to a request, and leaves its status and the local time then in `numbers` and `times`; it has to
        raise nothing.
        """
        self._ask = _ASK(answer)        # kept, as the machine has its address
        if not self._library.machine_run_by_blocks(self._machine, self._ask):
            raise MemoryError("Unicorn could not make one more Cortex-M4")
        return True

    def motors(self, counts_per_revolution: Sequence[int], pwms: int) -> None:
        """Give it an encoder for each of these, and so many PWM stages, before it is reset."""
        self._library.machine_motors(self._machine, len(counts_per_revolution),
                                     (c.c_uint32 * 8)(*counts_per_revolution), pwms)

    def reset(self, time_ns: int, cause: int = 0) -> None:
        """Start the program as after power-on (0), by the watchdog (1) or by itself (2)."""
        self._library.machine_reset(self._machine, time_ns, cause)

    def at(self, time_ns: int, local_ns: int) -> None:
        """The present is `time_ns`, when the local clock reads `local_ns`."""
        self._library.machine_at(self._machine, time_ns, local_ns)

    def run(self, until_ns: int = NEVER, budget: int = NEVER) -> int:
        """Run to the first instruction boundary at or after `until_ns`, or to `budget` instructions in all."""
        stop: int = self._library.machine_run(self._machine, until_ns, budget)
        return stop

    def settle(self, stop: int) -> int:
        """The node's time has come to where the run since `save` has ended with `stop`: nothing undoes it any more."""
        return stop

    def commands(self) -> Iterator[Call]:
        """Return the commands so far, and forget them."""
        numbers = self.numbers
        if not (count := numbers[COMMANDS_NOTED]):
            return iter(())
        numbers[COMMANDS_NOTED] = numbers[OTHERS] = 0
        return _COMMAND.iter_unpack(bytes(self._commands[:count * _COMMAND.size]))

    def answer(self, kind: int, status: int, real: float, local_ns: int) -> None:
        self._library.machine_answer(self._machine, kind, status, real, local_ns)

    def receive(self, port: int, data: bytes) -> None:
        """A frame has arrived at a port."""
        self._library.machine_receive(self._machine, port, data, len(data))

    def ring(self, channel: int) -> None:
        """A channel of the timer has reached its instant."""
        self._library.machine_ring(self._machine, channel)

    def slow_down(self, factor: float) -> None:
        """From now on an instruction lasts `factor` times as long as without faults."""
        self._busy_ns += (self.count - self._busy_count) * self._cost_ns
        self._busy_count = self.count
        cost = (self._cost * Fraction(factor)).limit_denominator(10**9)
        self._cost_ns = float(cost)
        self.set_cost(cost.numerator, cost.denominator)

    def set_cost(self, numerator: int, denominator: int) -> None:
        """From now on an instruction lasts numerator / denominator ns."""
        self._library.machine_cost(self._machine, numerator, denominator)

    def save(self) -> None:
        """Take a snapshot, in place of the one before."""
        self._library.machine_save(self._machine)

    def restore(self) -> None:
        """Go back to the snapshot."""
        self._library.machine_restore(self._machine)

    @property
    def now_ns(self) -> int:
        """The instant that the instructions so far have reached."""
        now_ns: int = self._library.machine_now(self._machine)
        return now_ns

    @property
    def count(self) -> int:
        """Instructions executed by the end of the last run."""
        return self.times[COUNT]

    def busy_ns_at(self, time_ns: int) -> float:
        """Return the time that all instructions before `time_ns` took, of those of the last run and before."""
        count: int = self._library.machine_count_at(self._machine, time_ns)
        return self._busy_ns + (count - self._busy_count) * self._cost_ns

    def latency_ns(self) -> int:
        """Return the longest time from an interrupt's instant to its entry since this was asked last."""
        latency_ns: int = self._library.machine_latency(self._machine)
        return latency_ns

    def stack_bytes(self) -> int:
        """Return how much of the main stack was ever used."""
        used: int = self._library.machine_stack_bytes(self._machine)
        return used

    @property
    def next_tick_ns(self) -> int:
        """The instant of SysTick's next expiry at the end of the last run, NEVER if it does not run."""
        return self.times[NEXT_TICK_NS]

    def ram(self) -> bytes:
        """Return the content of the RAM."""
        return c.string_at(self._library.machine_ram(self._machine), len(RAM))

    def fault(self) -> Fault:
        words = (c.c_uint32 * 20)()
        self._library.machine_fault(self._machine, words)
        return Fault(words[0], words[1], words[2], tuple(words[3:]))

    @property
    def closed(self) -> bool:
        return not self._machine

    def close(self) -> None:
        """Give its memory back; the machine may not be used afterwards."""
        if self._machine:
            self.before_close()
            for view in (self.times, self.numbers, self._commands):
                view.release()
            self.bytes.release()
            machine, self._machine = self._machine, None
            self._library.machine_free(machine)


@lru_cache(maxsize=1)
def _library() -> Any:
    """Load Unicorn's library and the machine's, which finds Unicorn's functions among those loaded."""
    c.CDLL(str(unicorn_library()), mode=c.RTLD_GLOBAL)
    library = c.CDLL(str(build_machine()))
    pointer, u32, u64, i64 = c.c_void_p, c.c_uint32, c.c_uint64, c.c_int64
    signatures: dict[str, tuple[Any, list[Any]]] = {
        "machine_new": (pointer, [u64, u64, u64, u64]), "machine_free": (None, [pointer]),
        "machine_load": (c.c_bool, [pointer, u32, c.c_char_p, u32]),
        "machine_identify": (None, [pointer, pointer]), "machine_ports": (None, [pointer, u32, pointer]),
        "machine_parameters": (None, [pointer, u32, pointer, pointer]),
        "machine_motors": (None, [pointer, u32, pointer, u32]), "machine_stack": (None, [pointer, u32, u32]),
        "machine_declare_ram": (c.c_bool, [pointer, u32]), "machine_cost": (None, [pointer, u64, u64]),
        "machine_count_at": (u64, [pointer, i64]), "machine_latency": (i64, [pointer]),
        "machine_reset": (None, [pointer, i64, u32]), "machine_at": (None, [pointer, i64, i64]),
        "machine_run": (u32, [pointer, i64, u64]), "machine_commands": (pointer, [pointer]),
        "machine_run_frame": (u32, [pointer, i64, i64, u64, u32, c.c_char_p, u32]),
        "machine_run_ring": (u32, [pointer, i64, i64, u64, u32]),
        "machine_run_by_blocks": (c.c_bool, [pointer, _ASK]), "machine_report": (pointer, [pointer]),
        "machine_command_bytes": (pointer, [pointer]), "machine_stack_bytes": (u32, [pointer]),
        "machine_ram": (pointer, [pointer]),
        "machine_answer": (None, [pointer, u32, c.c_int32, c.c_double, i64]),
        "machine_receive": (None, [pointer, u32, c.c_char_p, u32]), "machine_ring": (None, [pointer, u32]),
        "machine_save": (None, [pointer]), "machine_restore": (None, [pointer]), "machine_now": (i64, [pointer]),
        "machine_fault": (None, [pointer, pointer])}
    for name, (result, arguments) in signatures.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library
