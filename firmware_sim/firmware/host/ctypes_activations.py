"""Activations by ctypes, used where bound_activations.c was not compiled; bound_activations.pyi has their contract.

A firmware's functions are called without `argtypes`: to convert arguments takes longer than most calls
(docs/decisions/0002). The layout is that of `Host` in marconet_host.h.

The calls are handed over as a tuple, not as struct's iterator: the traceback of an exception may keep that, and Python
crashes when it collects such an iterator together with its memoryview.
"""

from __future__ import annotations

import ctypes as c
import struct
from collections.abc import Callable
from typing import Final, NoReturn

from firmware_sim.firmware.host.operations import ADJUST_CLOCK, HAND_OVER, SENSE, Carrier

CALLS: Final = 256
NO_VALUE: Final = -4            # BoardError of marconet_board.h
UNLOADED: Final = "the firmware is not loaded any more: its node has ended"
WITHIN: Final = "a function of the firmware runs, or its calls are being carried out: expected after that"
_ACTIVATION: Final = struct.Struct("@qIIIi")    # now, id, length, calls, code
_ASKED: Final = struct.Struct("@IIqd")          # question, id, integer, real
_ASK: Final = struct.Struct("@PP")
_CALL: Final = struct.Struct("@IIqqd")
_unpack_call, _unpack_calls = _CALL.unpack_from, _CALL.iter_unpack


class Activations:
    def __init__(self, memory: int, start: int, timer: int, receive: int, now: Callable[[], int], calls: Carrier,
                 keep: object, ours: bool) -> None:
        self._now, self._carry_out, self._answer_of = now, calls.carry_out, calls.answer
        self._read, self._keep = tuple(calls.read), keep
        self._error: BaseException | None = None
        self._busy = False
        first_call = _ACTIVATION.size + _ASKED.size + _ASK.size
        size = first_call + CALLS * _CALL.size
        host = memoryview((c.c_char * size).from_address(memory)).cast("B")
        self._clock, self._ids, self._lengths = host[:8].cast("q"), host[8:12].cast("I"), host[12:16].cast("I")
        self._count, self._code = host[16:20].cast("I"), host[20:24].cast("i")
        asked_end = _ACTIVATION.size + _ASKED.size
        self._asked, self._asked_real = host[_ACTIVATION.size:asked_end], host[asked_end - 8:asked_end].cast("d")
        self._question, self._asked_id = self._asked[:4].cast("I"), self._asked[4:8].cast("I")
        self._calls = host[first_call:]
        self._journals = [self._calls[:count * _CALL.size] for count in range(CALLS + 1)]   # of so many calls
        self._ask = (c.PYFUNCTYPE if ours else c.CFUNCTYPE)(None, c.c_void_p)(self._answer)
        _ASK.pack_into(host, asked_end, c.cast(self._ask, c.c_void_p).value, 0)
        function = (c.PYFUNCTYPE if ours else c.CFUNCTYPE)(c.c_int)
        self._start: Callable[[], int] = function(start)
        self._timer: Callable[[], int] = function(timer)
        self._receive: Callable[[bytes], int] = function(receive)

    def start(self) -> int:
        if self._busy:
            raise RuntimeError(WITHIN)
        self._busy = True
        try:
            self._clock[0] = self._now()
            calls = self._start()
            code = self._code[0]
            if self._error is not None:
                self._raise()
            self._carry_out(tuple(_unpack_calls(self._journals[calls])))
        finally:
            self._busy = False
        return code

    def timer(self, timer: int) -> None:
        if self._busy:
            raise RuntimeError(WITHIN)
        self._busy = True
        try:
            self._clock[0] = self._now()
            self._ids[0] = timer
            calls = self._timer()
            if self._error is not None:
                self._raise()
            if calls == 1:                  # most activations have one; to iterate over it would take longer
                self._carry_out((_unpack_call(self._calls),))
            elif calls:
                self._carry_out(tuple(_unpack_calls(self._journals[calls])))
        finally:
            self._busy = False

    def receive(self, port: int, data: bytes) -> None:
        if self._busy:
            raise RuntimeError(WITHIN)
        self._busy = True
        try:
            self._clock[0] = self._now()
            self._ids[0] = port
            self._lengths[0] = len(data)
            calls = self._receive(data)
            if self._error is not None:
                self._raise()
            if calls == 1:
                self._carry_out((_unpack_call(self._calls),))
            elif calls:
                self._carry_out(tuple(_unpack_calls(self._journals[calls])))
        finally:
            self._busy = False

    def close(self) -> None:
        if self._busy:
            raise RuntimeError(WITHIN)
        self._now = _unloaded               # every activation calls it first

    def _raise(self) -> None:
        """Raise what a call from within the firmware's function has raised."""
        error, self._error = self._error, None
        if error is not None:
            raise error

    def _answer(self, _context: object) -> None:
        """Called by the firmware's thread of control; an exception is kept, as C code cannot pass it on."""
        if self._error is not None:
            self._code[0] = NO_VALUE
            return
        try:
            if calls := self._count[0]:
                self._carry_out(tuple(_unpack_calls(self._journals[calls])))
            if self._question[0] == SENSE:          # the most frequent one: to unpack all would take longer
                result = self._read[self._asked_id[0]]()
            else:
                question, number, integer, real = _ASKED.unpack_from(self._asked)
                result = 0.0 if question == HAND_OVER else self._answer_of(question, number, integer, real)
                if question == ADJUST_CLOCK:
                    self._clock[0] = self._now()
            if result is None:
                self._code[0] = NO_VALUE
            else:
                self._asked_real[0] = result
                self._code[0] = 0
        except BaseException as error:
            self._error = error
            self._code[0] = NO_VALUE


def _unloaded() -> NoReturn:
    raise RuntimeError(UNLOADED)
