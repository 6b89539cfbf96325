"""A firmware's shared library, loaded for one robot.

    Library --Activations--> board_start, board_timer, board_receive --the firmware's calls--> a Carrier

Each robot loads a copy of the file, as two loads of one file share their variables.
"""

from __future__ import annotations

import ctypes as c
import os
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from firmware_sim.firmware.host.operations import Carrier
from fmus.call_record import CallRecord

if TYPE_CHECKING:
    from firmware_sim.firmware.host.bound_activations import Activations
else:
    try:
        from firmware_sim.firmware.host.bound_activations import Activations
    except ModuleNotFoundError:         # bound_activations.c was not compiled
        from firmware_sim.firmware.host.ctypes_activations import Activations

BYTES: Final = 16384            # of marconet_host.h
FUNCTIONS: Final = ("board_start", "board_timer", "board_receive")


class Library:
    """`timer(timer)`, `receive(port, frame)` and `start()` call the firmware, as `Activations` says.

    `now` returns the local time [ns]. `record` receives the function of the firmware `name` that runs. A firmware of
    `ours` is trusted to return soon and keeps the interpreter's lock meanwhile, as an FMU of ours does.
    """

    def __init__(self, file: Path, parameters: Sequence[Sequence[float]], signals: int, now: Callable[[], int],
                 calls: Carrier, name: str, record: CallRecord, *, ours: bool) -> None:
        library = _private_copy(file, ours)
        self._handle: int = library._handle
        values = (c.c_double * max(1, sum(map(len, parameters))))(*(value for row in parameters for value in row))
        ends = [0]
        for row in parameters:
            ends.append(ends[-1] + len(row))
        first = (c.c_uint32 * len(ends))(*ends)
        library.host_prepare(values, first, c.c_void_p(_address(record.call_word)),
                             *(c.c_int64(record.place(f"{function} of firmware {name}")) for function in FUNCTIONS))
        start, timer, receive = (_address_of(library[f"host_{function}"]) for function in ("start", "timer", "receive"))
        self._activations = Activations(_result(library.host_memory), start, timer, receive, now, calls,
                                        (values, first, record.call_word), ours)
        self.start, self.timer, self.receive = (self._activations.start, self._activations.timer,
                                                self._activations.receive)
        self.bytes = _view(library.host_bytes, BYTES)        # of the frames and texts in the firmware's calls
        self.signals = _view(library.host_signals, 8 * (signals + 1)).cast("d")   # value of each signal

    def close(self) -> None:
        """Unload the library; a function that is called afterwards raises RuntimeError."""
        self._activations.close()
        self.bytes.release()
        self.signals.release()
        if self._handle and os.name == "posix":
            import _ctypes

            handle, self._handle = self._handle, 0
            _ctypes.dlclose(handle)


def _address(word: memoryview) -> int:
    """Return the address of an integer that can be written to."""
    return c.addressof(c.c_char.from_buffer(word))


def _address_of(function: Any) -> int:
    return c.cast(function, c.c_void_p).value or 0


def _result(function: Any) -> int:
    """Return the pointer that a function of the library returns."""
    function.restype = c.c_void_p
    pointer: int = function()
    return pointer


def _view(function: Any, size: int) -> memoryview:
    """Return `size` bytes from the pointer on that a function of the library returns."""
    return memoryview((c.c_char * size).from_address(_result(function))).cast("B")


def _private_copy(file: Path, ours: bool) -> c.CDLL:
    """Load a copy of the library, which has variables of its own; the file of the copy is gone afterwards."""
    handle, name = tempfile.mkstemp(prefix="marconet-", suffix=file.suffix)
    try:
        with os.fdopen(handle, "wb") as copy:
            copy.write(file.read_bytes())
        return (c.PyDLL if ours else c.CDLL)(name)
    finally:
        Path(name).unlink()
