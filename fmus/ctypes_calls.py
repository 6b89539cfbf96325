"""BoundStep and BoundValues by ctypes, used where bound_calls.c was not compiled; bound_calls.pyi has their contract.

Arguments are ctypes objects made once and passed without `argtypes`: on CPython the fastest way through ctypes, about
0.6 of the time of typed prototypes (benchmarks/fmu_step.py). For this reason every C type is written out here.
"""

from __future__ import annotations

import ctypes as c
import struct
from collections.abc import Sequence
from typing import Any, Final

WARNING: Final = 1
WORD_BYTES: Final = c.sizeof(c.c_int64)


def _function(address: int, brief: bool) -> Any:
    return (c.PYFUNCTYPE if brief else c.CFUNCTYPE)(c.c_int)(address)


def _aligned_word(word: memoryview) -> memoryview:
    if word.nbytes != WORD_BYTES or c.addressof(c.c_char.from_buffer(word)) % WORD_BYTES:   # TypeError: read only
        raise ValueError(f"{word.nbytes} bytes: expected one aligned 64-bit word")
    return word.cast("B").cast("q")


class BoundStep:
    def __init__(self, function: int, instance: int, fmi: int, brief: bool) -> None:
        self._call = _function(function, brief)
        self._word: memoryview | list[int] = [0]
        self._number = 0
        self._time, self._h, self._last = c.c_double(), c.c_double(), c.c_double(float("nan"))
        self._flags = (c.c_bool * 3)()              # asks to end, ended early, event
        common = (c.c_void_p.from_param(instance), self._time, self._h)
        if fmi == 2:
            self._arguments: tuple[Any, ...] = (*common, c.c_int.from_param(1))
        else:
            end, early, event = (c.byref(self._flags, place) for place in range(3))
            self._arguments = (*common, c.c_bool.from_param(True), event, end, early, c.byref(self._last))

    def do(self, time: float, h: float) -> int:
        self._time.value = time
        self._h.value = h
        self._word[0] = self._number
        status: int = self._call(*self._arguments)
        self._word[0] = 0
        return status

    def watch(self, word: memoryview, number: int) -> None:
        self._word, self._number = _aligned_word(word), number

    @property
    def last(self) -> float:
        return self._last.value

    @property
    def ended(self) -> bool:
        return self._flags[0] or self._flags[1]

    @property
    def asks_to_end(self) -> bool:
        return self._flags[0]

    @property
    def early(self) -> bool:
        return self._flags[1]

    @property
    def needs_event(self) -> bool:
        return self._flags[2]


class BoundValues:
    def __init__(self, function: int, instance: int, references: Sequence[int], fmi: int, brief: bool) -> None:
        count = len(references)
        layout = struct.Struct(f"{count}d")
        self._pack, self._unpack = layout.pack_into, layout.unpack_from
        self._call = _function(function, brief)
        self._word: memoryview | list[int] = [0]
        self._number = 0
        self._values = (c.c_double * count)()
        size = c.c_size_t.from_param(count)
        self._arguments = (c.c_void_p.from_param(instance), c.byref((c.c_uint * count)(*references)), size,
                           c.byref(self._values), *([size] if fmi == 3 else []))

    def set(self, values: Sequence[float]) -> int:
        try:
            self._pack(self._values, 0, *values)
        except struct.error as error:
            raise TypeError(str(error)) from None
        return self._do()

    def get(self) -> tuple[float, ...] | int:
        status = self._do()
        return status if status > WARNING or status < 0 else self._unpack(self._values)

    def watch(self, word: memoryview, number: int) -> None:
        self._word, self._number = _aligned_word(word), number

    def _do(self) -> int:
        self._word[0] = self._number
        status: int = self._call(*self._arguments)
        self._word[0] = 0
        return status
