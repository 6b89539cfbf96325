"""A firmware's shared library, loaded for one robot, and the journal of its calls (`marconet_host.c`).

Each robot loads a copy of the file, as two loads of one file share their variables.

*Invariants*
- the calls of one activation are carried out in order, at the instant of the activation;
- an exception of `carry_out` or `answer` reaches the caller of `start`, `timer` or `receive` after the firmware's
  function has returned; calls after it are dropped.
"""

from __future__ import annotations

import ctypes as c
import os
import struct
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Final

from fmus.call_record import CallRecord

CALLS: Final = 256              # as in marconet_host.c, like all of the layout below
BYTES: Final = 16384
_ACTIVATION: Final = struct.Struct("@qIIIi")     # now, id, length, calls, code
_ASKED: Final = struct.Struct("@IIqd")          # question, id, integer, real
_HEAD: Final = struct.Struct("@qIIIi IIqd PPP Pqqqq II")    # both, `ask`, the pointers and what runs, for C alone
_CALL: Final = struct.Struct("@IIqqd")
_unpack_call, _unpack_calls = _CALL.unpack_from, _CALL.iter_unpack


# Operation of marconet_host.c. Plain numbers: to compare members of an enumeration takes longer than most calls.
SEND: Final = 0
SET_TIMER: Final = 1
SET_DELAY: Final = 2
CANCEL: Final = 3
PROMISE: Final = 4
ACTUATE: Final = 5
COUNT: Final = 6
EVENT: Final = 7
MISTAKE: Final = 8

# Question of marconet_host.c
HAND_OVER: Final = 0
ADJUST_CLOCK: Final = 1
SENSE: Final = 2
RANDOM: Final = 3

Call = tuple[int, int, int, int, float]         # operation, id, integer, place, real: see `Call` of marconet_host.c

NO_VALUE: Final = -4            # BoardError of marconet_board.h


class Library:
    """`carry_out(calls)` gets the calls of the firmware. Those whose result the firmware waits for go to
    `read[number]()` for a sensor, else to `answer(question, id, integer, real)`; both return None for BOARD_NO_VALUE.

    `record` receives the function of the firmware `name` that runs. `now` returns the local time [ns]. A firmware of
    `ours` is trusted to return soon and keeps the interpreter's lock meanwhile, as an FMU of ours does.
    """

    def __init__(self, file: Path, parameters: Sequence[Sequence[float]], signals: int, now: Callable[[], int],
                 carry_out: Callable[[Iterable[Call]], None], read: Sequence[Callable[[], float | None]],
                 answer: Callable[[int, int, int, float], float | None], name: str, record: CallRecord, *,
                 ours: bool) -> None:
        self._now, self._carry_out, self._read, self._answer_of = now, carry_out, read, answer
        self._error: BaseException | None = None
        library = _private_copy(file, ours)
        self._handle: int = library._handle
        library.host_memory.restype = c.c_void_p
        base: int = library.host_memory()
        size = _HEAD.size + CALLS * _CALL.size + BYTES + 8 * (signals + 1)
        memory = memoryview((c.c_char * size).from_address(base)).cast("B")
        calls_end = _HEAD.size + CALLS * _CALL.size
        asked_end = _ACTIVATION.size + _ASKED.size
        self._clock, self._ids, self._lengths = memory[:8].cast("q"), memory[8:12].cast("I"), memory[12:16].cast("I")
        self._count, self._code = memory[16:20].cast("I"), memory[20:24].cast("i")
        self._asked, self._asked_real = memory[_ACTIVATION.size:asked_end], memory[asked_end - 8:asked_end].cast("d")
        self._calls = memory[_HEAD.size:calls_end]
        self._journals = [self._calls[:count * _CALL.size] for count in range(CALLS + 1)]   # of so many calls
        self.bytes = memory[calls_end:calls_end + BYTES]
        self.signals = memory[calls_end + BYTES:].cast("d")     # value of each signal
        # kept, as the library has their addresses
        self._values = (c.c_double * max(1, sum(map(len, parameters))))(*(value for row in parameters for value in row))
        ends = [0]
        for row in parameters:
            ends.append(ends[-1] + len(row))
        self._first = (c.c_uint32 * len(ends))(*ends)
        self._ask = (c.PYFUNCTYPE if ours else c.CFUNCTYPE)(None)(self._answer)
        struct.pack_into("@PPPPqqq", memory, asked_end, c.cast(self._ask, c.c_void_p).value,
                         c.addressof(self._values), c.addressof(self._first), _address(record.call_word),
                         *(record.place(f"{function} of firmware {name}")
                           for function in ("board_start", "board_timer", "board_receive")))
        self._word = record.call_word               # kept, as the library has its address
        # no prototypes: to convert arguments takes longer than most calls (docs/decisions/0002)
        self._start: Callable[[], int] = library.host_start
        self._timer: Callable[[], int] = library.host_timer
        self._receive: Callable[[bytes], int] = library.host_receive

    def start(self) -> int:
        """Call `board_start`; return its result."""
        self._clock[0] = self._now()
        calls = self._start()
        code = self._code[0]
        if self._error is not None:
            self._raise()
        self._carry_out(_unpack_calls(self._journals[calls]))
        return code

    def timer(self, timer: int) -> None:
        """Call `board_timer`."""
        self._clock[0] = self._now()
        self._ids[0] = timer
        calls = self._timer()
        if self._error is not None:
            self._raise()
        if calls == 1:                  # most activations have one; to iterate over it would take longer
            self._carry_out((_unpack_call(self._calls),))
        elif calls:
            self._carry_out(_unpack_calls(self._journals[calls]))

    def receive(self, port: int, data: bytes) -> None:
        """Call `board_receive`."""
        self._clock[0] = self._now()
        self._ids[0] = port
        self._lengths[0] = len(data)
        calls = self._receive(data)
        if self._error is not None:
            self._raise()
        if calls == 1:
            self._carry_out((_unpack_call(self._calls),))
        elif calls:
            self._carry_out(_unpack_calls(self._journals[calls]))

    def close(self) -> None:
        """Unload the library; nothing may be called afterwards."""
        if self._handle and os.name == "posix":
            import _ctypes

            self._clock.release()
            handle, self._handle = self._handle, 0
            _ctypes.dlclose(handle)

    def _raise(self) -> None:
        """Raise what a call from within the firmware's function has raised."""
        error, self._error = self._error, None
        if error is not None:
            raise error

    def _answer(self) -> None:
        """Called by the firmware's thread of control; an exception is kept, as C code cannot pass it on."""
        self._code[0] = NO_VALUE
        if self._error is not None:
            return
        try:
            if calls := self._count[0]:
                self._carry_out(_unpack_calls(self._journals[calls]))
            question, number, integer, real = _ASKED.unpack_from(self._asked)
            if question == SENSE:
                result = self._read[number]()
            else:
                result = 0.0 if question == HAND_OVER else self._answer_of(question, number, integer, real)
                if question == ADJUST_CLOCK:
                    self._clock[0] = self._now()
        except BaseException as error:
            self._error = error
            return
        if result is not None:
            self._asked_real[0] = result
            self._code[0] = 0


def _address(word: memoryview) -> int:
    """Return the address of an integer that can be written to."""
    return c.addressof(c.c_char.from_buffer(word))


def _private_copy(file: Path, ours: bool) -> c.CDLL:
    """Load a copy of the library, which has variables of its own; the file of the copy is gone afterwards."""
    handle, name = tempfile.mkstemp(prefix="marconet-", suffix=file.suffix)
    try:
        with os.fdopen(handle, "wb") as copy:
            copy.write(file.read_bytes())
        return (c.PyDLL if ours else c.CDLL)(name)
    finally:
        Path(name).unlink()
