"""While an FMI call runs, its number stands in a word that outlives the process."""

from __future__ import annotations

import ctypes
import sys
from typing import Any

import pytest

from fmus import ctypes_calls
from fmus.build import build_model
from fmus.call_record import NoRecord, recorded
from fmus.describe_fmu import describe
from fmus.plant import Plant

try:
    from fmus import bound_calls
except ImportError:
    bound_calls = None      # type: ignore[assignment]
KINDS = [ctypes_calls, *([bound_calls] if bound_calls else [])]
STEP2 = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int)
VALUES2 = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p)


class Names:
    """A record that numbers names from 1 and remembers every name that was under way."""

    def __init__(self) -> None:
        self.call_word = memoryview(bytearray(8)).cast("q")
        self.names: list[str] = []

    def place(self, call: str) -> int:
        if call not in self.names:
            self.names.append(call)
        return self.names.index(call) + 1


@pytest.mark.parametrize("kind", KINDS)
def test_a_step_and_an_exchange_of_values_are_in_the_word_while_they_run(kind: Any) -> None:
    word = memoryview(bytearray(8)).cast("q")
    seen: list[int] = []
    step2 = STEP2(lambda *_: seen.append(word[0]) or 0)
    values2 = VALUES2(lambda *_: seen.append(word[0]) or 0)
    step = kind.BoundStep(ctypes.cast(step2, ctypes.c_void_p).value, 0, 2, True)
    values = kind.BoundValues(ctypes.cast(values2, ctypes.c_void_p).value, 0, [1, 2], 2, True)

    step.do(0.0, 1.0)                   # nobody watches yet
    step.watch(word, 7)
    values.watch(word, 8)
    step.do(0.0, 1.0)
    after_step = word[0]
    values.set([1.0, 2.0])
    values.get()

    assert seen == [0, 7, 8, 8]
    assert (after_step, word[0]) == (0, 0)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("word", [memoryview(bytearray(4)), memoryview(bytes(8)), memoryview(bytearray(16))[1:9]])
def test_a_word_that_is_none_is_refused(kind: Any, word: memoryview) -> None:
    step = kind.BoundStep(0, 0, 2, True)

    with pytest.raises((ValueError, TypeError, BufferError)):
        step.watch(word, 1)


@pytest.mark.parametrize("kind", KINDS)
def test_a_number_fills_all_bytes_of_the_word_whatever_their_type(kind: Any) -> None:
    word = memoryview(bytearray(8))
    seen: list[bytes] = []
    step2 = STEP2(lambda *_: seen.append(bytes(word)) or 0)
    step = kind.BoundStep(ctypes.cast(step2, ctypes.c_void_p).value, 0, 2, True)

    step.watch(word, 1_000)
    step.do(0.0, 1.0)

    assert seen == [(1_000).to_bytes(8, sys.byteorder)]


def test_the_calls_of_a_plant_are_named_with_their_model() -> None:
    names = Names()

    with Plant(describe(build_model("wheel_motor")), "left", record=names) as plant:
        plant.output_group(["omega"]).read()
        plant.advance_to(1_000_000)

    assert {f"fmi3{call} of plant wheel_motor" for call in (
        "InstantiateCoSimulation", "ExitInitializationMode", "DoStep", "GetFloat64", "Terminate", "FreeInstance",
    )} <= set(names.names)
    assert names.call_word[0] == 0


def test_a_rare_call_that_fails_in_python_leaves_the_word_empty() -> None:
    names = Names()

    def fails() -> None:
        assert names.call_word[0] == 1
        raise ValueError("no such variable")

    with pytest.raises(ValueError, match="no such variable"):
        recorded(fails, names, "fmi3Reset of plant x")()

    assert names.call_word[0] == 0


def test_without_a_record_nothing_is_named() -> None:
    record = NoRecord()

    assert record.place("fmi3DoStep of plant x") == 0
    assert record.call_word[0] == 0
