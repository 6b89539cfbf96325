"""The calls between a firmware on the host and its node's process, made by ctypes and by the extension in C.

The firmware is `probe`, loaded as one of ours, which keeps the interpreter lock, and as a foreign one.
"""

from __future__ import annotations

import ctypes
import gc
import threading
import weakref
from collections.abc import Callable, Iterable
from enum import IntEnum
from pathlib import Path
from typing import Any

import pytest

from firmware_sim.firmware import program
from firmware_sim.firmware.build import FIRMWARE, build_for_host
from firmware_sim.firmware.description import read_description
from firmware_sim.firmware.host import ctypes_activations, library, operations
from firmware_sim.firmware.host.library import Library
from firmware_sim.firmware.host.operations import ACTUATE, COUNT, EVENT, RANDOM, SEND, SET_TIMER, Call
from firmware_sim.firmware.new_folder import write_new
from firmware_sim.firmware.program import firmware_class
from tests.extensions import extension
from tests.firmware_sim.board_bench import BoardBench

PROBE = Path(__file__).parent / "probe"
NOW_NS = 1_000
RUNS = "a function of the firmware runs"
GONE = "the firmware is not loaded any more"


class Timer(IntEnum):
    """The timers of probe.c: in each, the firmware does one thing."""

    ORDER, READ, READ_TWICE, ADJUST, DRAW, MANY_CALLS, MANY_BYTES, TOO_LONG, WAIT, WAIT_LONG, ACT_AND_READ = range(11)


class Notes:
    """A Carrier that notes what it is told, a clock and a record. A test may replace `sense`, `act` and `now_ns`."""

    def __init__(self) -> None:
        self.told: list[Any] = []
        self.written = [0.0]
        self.sense: list[Callable[[], float | None]] = [lambda: 2.5, lambda: 3]
        self.act: Callable[[tuple[float]], object] = self.told.append
        self.read: list[Callable[[], float | None]] = [lambda: self.sense[0](), lambda: self.sense[1]()]
        self.write: list[Callable[[tuple[float]], object]] = [lambda values: self.act(values)]
        self.send: list[Callable[[bytes], None]] = [self.told.append]
        self.now_ns = NOW_NS
        self.call_word = memoryview(bytearray(8)).cast("q")
        self.hold_word = memoryview(bytearray(8)).cast("q")
        self.names: list[str] = []
        self.library: Library

    def carry_out(self, calls: Iterable[Call]) -> None:
        for operation, number, integer, place, real in calls:
            if operation == ACTUATE:
                self.written[number] = real
                self.write[number]((real,))
            elif operation == SEND and integer >= 0:
                self.send[number](bytes(self.library.bytes[place:place + integer]))
            else:
                self.told.append((operation, number, integer, place, real))

    def answer(self, question: int, number: int, integer: int, real: float) -> float | None:
        self.told.append((question, number, integer, real))
        self.now_ns += integer
        return 4e9 if question == RANDOM else real

    def now(self) -> int:
        return self.now_ns

    def place(self, call: str) -> int:
        self.names.append(call)
        return len(self.names)


class Probe(Notes):
    """The firmware, loaded and started, and the word that it shares with the test."""

    def __init__(self, ours: bool, code: float = 0) -> None:
        super().__init__()
        self.word = ctypes.c_int64()
        parameters = [[float(ctypes.addressof(self.word))], [float(code)]]
        self.library = Library(build_for_host(PROBE), parameters, 1, self.now, self, "probe", self, ours=ours)
        self.code = self.library.start()
        self.started = self.told.copy()
        self.told.clear()


@pytest.fixture(scope="module")
def bound_activations(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return extension("firmware_sim.firmware.host.bound_activations", tmp_path_factory.mktemp("built"))


@pytest.fixture(params=["ctypes", "C"])
def load(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> type[Probe]:
    kind = request.getfixturevalue("bound_activations") if request.param == "C" else ctypes_activations
    monkeypatch.setattr(library, "Activations", kind.Activations)
    return Probe


@pytest.fixture(params=[True, False], ids=["ours", "foreign"])
def probe(request: pytest.FixtureRequest, load: type[Probe]) -> Probe:
    return load(request.param)


def raises(error: BaseException) -> Callable[..., Any]:
    def fails(*_: object) -> Any:
        raise error

    return fails


def test_the_calls_of_a_function_are_carried_out_in_their_order(probe: Probe) -> None:
    probe.library.timer(Timer.ORDER)

    place = len(b"abc")
    assert probe.told == [b"a", (1.5,), (SET_TIMER, 3, NOW_NS + 5, 1, 0.0), b"bc",
                          (COUNT, 0, 4_000_000_000, place, 0.0), (EVENT, 0, len("done"), place, 0.0)]
    assert bytes(probe.library.bytes[place:place + 4]) == b"done"
    assert probe.written == [1.5]


def test_the_start_returns_its_code_and_its_calls_are_carried_out(load: type[Probe]) -> None:
    probe = load(True, -7)

    assert probe.code == -7
    assert probe.started == [(COUNT, 0, 1, 0, 0.0)]


@pytest.mark.parametrize("frame", [b"", b"\0\1\2", bytes(2048)])
def test_a_frame_arrives_as_it_is(probe: Probe, frame: bytes) -> None:
    probe.library.receive(0, frame)

    assert probe.told == [frame]
    assert probe.library.signals[0] == len(frame)


@pytest.mark.parametrize(("value", "acts"), [(0.1, 0.1), (-3, -3.0), (None, -4.0)])
def test_a_sensor_is_read_when_it_is_asked_for(probe: Probe, value: float | None, acts: float) -> None:
    probe.sense[0] = lambda: value

    probe.library.timer(Timer.READ)

    assert probe.told == [(acts,)]


def test_sensors_are_those_of_the_start_whatever_becomes_of_the_list(probe: Probe) -> None:
    probe.sense[0] = lambda: probe.read.clear() or 1.0          # type: ignore[func-returns-value]

    probe.library.timer(Timer.READ_TWICE)

    assert probe.told == [(0.0,)]           # the sum of the two results, BOARD_OK


def test_after_an_adjustment_the_clock_is_read_anew(probe: Probe) -> None:
    probe.library.timer(Timer.ADJUST)

    assert probe.told == [(operations.ADJUST_CLOCK, 0, 7, 0.5), (NOW_NS + 7.0,)]


def test_random_bits_are_those_of_the_answer(probe: Probe) -> None:
    probe.library.timer(Timer.DRAW)

    assert probe.told == [(RANDOM, 0, 0, 0.0), (4e9,)]


def test_more_calls_than_the_journal_holds_are_all_carried_out(probe: Probe) -> None:
    probe.library.timer(Timer.MANY_CALLS)
    acts = probe.told.copy()
    probe.told.clear()
    probe.library.timer(Timer.MANY_BYTES)

    assert acts == [(float(k),) for k in range(300)]
    assert probe.told == [bytes([k]) + bytes(2047) for k in range(20)]


def test_a_frame_that_is_too_long_is_told_and_not_sent(probe: Probe) -> None:
    probe.library.timer(Timer.TOO_LONG)

    assert probe.told == [(SEND, 0, -2049, 0, 0.0), (-3.0,)]


@pytest.mark.parametrize("error", [ValueError("no value"), KeyboardInterrupt(), SystemExit(3)])
def test_an_exception_of_a_sensor_is_raised_when_the_function_has_returned(probe: Probe, error: BaseException) -> None:
    asked: list[int] = []
    probe.sense = [raises(error), lambda: asked.append(1)]      # type: ignore[list-item, return-value]

    with pytest.raises(type(error)) as raised:
        probe.library.timer(Timer.READ_TWICE)

    assert raised.value is error
    assert raised.traceback[-1].name == "fails"
    assert probe.word.value == 1            # the function went on to its end
    assert (asked, probe.told) == ([], [])  # nothing more was asked, or carried out


def test_an_exception_of_a_call_before_a_question_is_raised_when_the_function_has_returned(probe: Probe) -> None:
    asked: list[int] = []
    probe.sense[0] = lambda: asked.append(1)                    # type: ignore[func-returns-value]
    probe.act = raises(ValueError("stopped"))

    with pytest.raises(ValueError, match="stopped"):
        probe.library.timer(Timer.ACT_AND_READ)

    assert probe.word.value == 1
    assert (asked, probe.told) == ([], [])


def test_an_answer_that_is_no_number_is_an_error(probe: Probe) -> None:
    probe.sense[0] = lambda: "warm"                             # type: ignore[return-value]

    with pytest.raises(TypeError):
        probe.library.timer(Timer.READ)


def test_after_an_exception_the_firmware_goes_on(probe: Probe) -> None:
    probe.act = raises(ValueError("stopped"))
    with pytest.raises(ValueError, match="stopped"):
        probe.library.timer(Timer.ORDER)
    told_until_then = probe.told.copy()
    probe.act = probe.told.append

    probe.library.timer(Timer.READ)

    assert told_until_then == [b"a"]        # the calls after the one that failed were dropped
    assert probe.told == [b"a", (2.5,)]


@pytest.mark.parametrize("what", ["timer", "receive", "start", "close"])
@pytest.mark.parametrize("during", ["a question", "its calls"])
def test_nothing_begins_within_an_activation(probe: Probe, what: str, during: str) -> None:
    arguments = {"timer": (Timer.READ,), "receive": (0, b"")}.get(what, ())

    def within(*_: object) -> float:
        with pytest.raises(RuntimeError, match=RUNS):
            getattr(probe.library, what)(*arguments)
        probe.told.append("refused")
        return 1.0

    if during == "a question":
        probe.sense[0] = within
    else:
        probe.act = within
    probe.library.timer(Timer.READ)

    assert probe.told == (["refused", (1.0,)] if during == "a question" else ["refused"])


def test_after_the_end_nothing_is_called(probe: Probe) -> None:
    probe.library.close()
    probe.library.close()

    with pytest.raises(RuntimeError, match=GONE):
        probe.library.timer(Timer.READ)
    with pytest.raises(RuntimeError, match=GONE):
        probe.library.receive(0, b"")
    with pytest.raises(RuntimeError, match=GONE):
        probe.library.start()
    with pytest.raises(ValueError, match="released"):
        probe.library.bytes[0]
    with pytest.raises(ValueError, match="released"):
        probe.library.signals[0]


@pytest.mark.parametrize("number", [-1, 2**32, 2**70])
def test_a_number_beyond_32_bits_is_refused(probe: Probe, number: int) -> None:
    with pytest.raises(ValueError):
        probe.library.timer(number)
    with pytest.raises(ValueError):
        probe.library.receive(number, b"")

    assert probe.told == []


@pytest.mark.parametrize("now_ns", [2**63, -2**63 - 1])
def test_a_time_beyond_64_bits_is_refused(probe: Probe, now_ns: int) -> None:
    probe.now_ns = now_ns

    with pytest.raises(ValueError):
        probe.library.timer(Timer.READ)

    assert probe.told == []


@pytest.mark.parametrize("closed", [True, False])
def test_a_cycle_through_the_library_is_collected(load: type[Probe], closed: bool) -> None:
    carrier = load(True)
    carrier.board = carrier.library.timer                       # type: ignore[attr-defined]
    gone = weakref.ref(carrier)
    if closed:
        carrier.library.close()
    del carrier

    gc.collect()

    assert gone() is None


def test_the_record_has_the_function_that_runs_and_nothing_afterwards(probe: Probe) -> None:
    seen: list[int] = []
    probe.sense[0] = lambda: seen.append(probe.call_word[0]) or 1.0     # type: ignore[func-returns-value]
    probe.act = lambda _: seen.append(probe.call_word[0])

    probe.library.timer(Timer.READ)

    assert [probe.names[number - 1] if number else "" for number in seen] == ["board_timer of firmware probe", ""]
    assert probe.call_word[0] == 0


@pytest.mark.parametrize("ours", [True, False])
def test_only_a_foreign_firmware_lets_other_threads_run_meanwhile(load: type[Probe], ours: bool) -> None:
    probe, stop = load(ours), threading.Event()

    def change() -> None:
        while not stop.is_set():
            probe.word.value += 1

    other = threading.Thread(target=change)
    other.start()
    probe.library.timer(Timer.WAIT if ours else Timer.WAIT_LONG)
    stop.set()
    other.join()

    assert probe.word.value > 0
    assert probe.told == [(0.0 if ours else 1.0,)]


def test_a_question_of_a_foreign_firmware_is_answered_with_the_lock(probe: Probe) -> None:
    """Threads that run Python meanwhile, and the answer's own Python, do not meet."""
    stop = threading.Event()
    other = threading.Thread(target=lambda: [None for _ in iter(stop.is_set, True)])
    other.start()
    for _ in range(1_000):
        probe.library.timer(Timer.READ_TWICE)
    stop.set()
    other.join()

    assert probe.told == [(0.0,)] * 1_000


def test_the_firmware_that_comes_with_marconet_is_ours_and_any_other_is_foreign(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_new(tmp_path / "blinker")
    loaded: dict[str, bool] = {}

    class Noted(Library):
        def __init__(self, *arguments: Any, ours: bool) -> None:
            loaded[arguments[0].stem] = ours
            super().__init__(*arguments, ours=ours)

    monkeypatch.setattr(program, "Library", Noted)
    for folder in (FIRMWARE / "beacon", tmp_path / "blinker"):
        made: Any = firmware_class(read_description(folder), folder)
        made(BoardBench(ports=("radio",)).board(), made.Settings())

    assert loaded == {"beacon": True, "blinker": False}
