"""Registers, memory, breakpoints and checkpoints of a machine: the functions of debug.c, bound to one machine."""

from __future__ import annotations

import ctypes as c
import struct
from typing import Any, Final

from firmware_sim.cortex_m.gdb.target_description import BYTES, LAYOUT

_C_LAYOUT: Final = struct.Struct("<17I4x16Q7I")        # `Registers` of debug.c
_SIGNATURES: Final[dict[str, tuple[Any, list[Any]]]] = {
    "machine_set_breakpoint": (c.c_bool, [c.c_void_p, c.c_uint32]),
    "machine_clear_breakpoint": (None, [c.c_void_p, c.c_uint32]),
    "machine_heed_breakpoints": (None, [c.c_void_p, c.c_bool]),
    "machine_pc": (c.c_uint32, [c.c_void_p]),
    "machine_read_registers": (None, [c.c_void_p, c.c_char_p]),
    "machine_write_register": (c.c_bool, [c.c_void_p, c.c_uint32, c.c_uint64]),
    "machine_read_memory": (c.c_uint32, [c.c_void_p, c.c_uint32, c.c_uint32, c.c_char_p]),
    "machine_write_memory": (c.c_bool, [c.c_void_p, c.c_uint32, c.c_uint32, c.c_char_p]),
    "machine_new_checkpoint": (c.c_void_p, [c.c_void_p]),
    "machine_return_to": (None, [c.c_void_p, c.c_void_p]),
    "machine_free_checkpoint": (None, [c.c_void_p])}


class Target:
    """`library` is the machine's library, `machine` the machine in it."""

    def __init__(self, library: Any, machine: int) -> None:
        for name, (result, arguments) in _SIGNATURES.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
        self._library, self._machine = library, machine
        self.breakpoints: set[int] = set()

    def pc(self) -> int:
        return int(self._library.machine_pc(self._machine))

    def registers(self) -> bytes:
        """Return all registers in gdb's order, little endian."""
        buffer = c.create_string_buffer(_C_LAYOUT.size + 8)     # C may pad the end
        self._library.machine_read_registers(self._machine, buffer)
        return LAYOUT.pack(*_C_LAYOUT.unpack_from(buffer.raw))

    def write_register(self, number: int, value: bytes) -> bool:
        return number < len(BYTES) and len(value) == BYTES[number] and bool(
            self._library.machine_write_register(self._machine, number, int.from_bytes(value, "little")))

    def read_memory(self, address: int, length: int) -> bytes:
        """Return the bytes from `address` on, up to the first that is not there."""
        buffer = c.create_string_buffer(max(1, length))
        there = self._library.machine_read_memory(self._machine, address, length, buffer)
        return buffer.raw[:there]

    def write_memory(self, address: int, data: bytes) -> bool:
        """Write into the RAM; False elsewhere."""
        return bool(self._library.machine_write_memory(self._machine, address, len(data), data))

    def set_breakpoint(self, address: int) -> bool:
        if address in self.breakpoints:
            return True
        if not self._library.machine_set_breakpoint(self._machine, address):
            return False
        self.breakpoints.add(address)
        return True

    def clear_breakpoint(self, address: int) -> None:
        self._library.machine_clear_breakpoint(self._machine, address)
        self.breakpoints.discard(address)

    def heed_breakpoints(self, heed: bool) -> None:
        """Let breakpoints stop the machine, or pass them over."""
        self._library.machine_heed_breakpoints(self._machine, heed)

    def checkpoint(self) -> int:
        """Return a checkpoint of the present state, to be freed by `free`."""
        made = self._library.machine_new_checkpoint(self._machine)
        if not made:
            raise MemoryError("no memory for a checkpoint of the debugger")
        return int(made)

    def return_to(self, checkpoint: int) -> None:
        self._library.machine_return_to(self._machine, checkpoint)

    def free(self, checkpoint: int) -> None:
        self._library.machine_free_checkpoint(checkpoint)
