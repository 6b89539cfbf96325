"""A machine from Python: the functions of its library (`machine.c`), bound once.

A machine runs until its program sleeps, asks for something outside (`commands`) or reaches a limit.
"""

from __future__ import annotations

import ctypes as c
import struct
from collections.abc import Iterator, Sequence
from enum import IntEnum
from fractions import Fraction
from functools import lru_cache
from typing import Any, Final, NamedTuple

from firmware_sim.cortex_m.build import build_machine, unicorn_library
from firmware_sim.cortex_m.image import RAM, Image

COMMANDS: Final = 256               # as in machine.h, like all below
COMMAND_BYTES: Final = 16384
NEVER: Final = 2**63 - 1
_COMMAND: Final = struct.Struct("@IIqqdQ")


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
    WATCHDOG = 10
    CAPTURE = 11
    END = 12
    RESTART = 13
    ADJUST_CLOCK = 14
    SENSE = 15
    RANDOM = 16


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
        tick, instruction = Fraction(10**9, clock_hz), Fraction(10**9, clock_hz) * Fraction(str(cost))
        self._machine = library.machine_new(tick.numerator, tick.denominator, instruction.numerator,
                                            instruction.denominator)
        if not self._machine:
            raise MemoryError("Unicorn could not make one more Cortex-M4")
        machine = self._machine
        for address, content in image.segments:
            library.machine_load(machine, address, content, len(content))
        library.machine_identify(machine, (c.c_uint32 * 4)(*unique_id))
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
        self.ram = memoryview((c.c_char * len(RAM)).from_address(library.machine_ram(machine))).cast("B")

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

    def commands(self) -> Iterator[tuple[int, int, int, int, float, int]]:
        """Return the commands so far as (kind, id, integer, place, real, count of instructions), and forget them."""
        count = self._library.machine_command_count(self._machine)
        found = _COMMAND.iter_unpack(bytes(self._commands[:count * _COMMAND.size]))
        self._library.machine_clear_commands(self._machine)
        return found

    def answer(self, kind: int, status: int, real: float, local_ns: int) -> None:
        self._library.machine_answer(self._machine, kind, status, real, local_ns)

    def receive(self, port: int, data: bytes) -> None:
        """A frame has arrived at a port."""
        self._library.machine_receive(self._machine, port, data, len(data))

    def ring(self, channel: int) -> None:
        """A channel of the timer has reached its instant."""
        self._library.machine_ring(self._machine, channel)

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
        """Instructions executed so far."""
        count: int = self._library.machine_count(self._machine)
        return count

    @property
    def next_tick_ns(self) -> int:
        """The instant of SysTick's next expiry, NEVER if it does not run."""
        next_ns: int = self._library.machine_next_tick(self._machine)
        return next_ns

    def can_wake(self, timers_armed: bool) -> bool:
        """Whether an interrupt that is enabled, other than SysTick's, can end a sleep."""
        wakers: int = self._library.machine_wakers(self._machine)
        return bool(wakers & 2 or (wakers & 1 and timers_armed))

    def fault(self) -> Fault:
        words = (c.c_uint32 * 20)()
        self._library.machine_fault(self._machine, words)
        return Fault(words[0], words[1], words[2], tuple(words[3:]))

    def close(self) -> None:
        """Give its memory back; the machine may not be used afterwards."""
        if self._machine:
            self._commands.release()
            self.bytes.release()
            self.ram.release()
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
        "machine_reset": (None, [pointer, i64, u32]), "machine_at": (None, [pointer, i64, i64]),
        "machine_run": (u32, [pointer, i64, u64]), "machine_commands": (pointer, [pointer]),
        "machine_command_bytes": (pointer, [pointer]), "machine_command_count": (u32, [pointer]),
        "machine_clear_commands": (None, [pointer]), "machine_ram": (pointer, [pointer]),
        "machine_answer": (None, [pointer, u32, c.c_int32, c.c_double, i64]),
        "machine_receive": (None, [pointer, u32, c.c_char_p, u32]), "machine_ring": (None, [pointer, u32]),
        "machine_save": (None, [pointer]), "machine_restore": (None, [pointer]), "machine_now": (i64, [pointer]),
        "machine_count": (u64, [pointer]), "machine_next_tick": (i64, [pointer]), "machine_wakers": (u32, [pointer]),
        "machine_fault": (None, [pointer, pointer])}
    for name, (result, arguments) in signatures.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library
