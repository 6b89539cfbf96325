"""The calls of a firmware to its board, carried out: timers, frames, actuators, counters, promises, events.

    firmware --Operation--> carry_out --at, after, send, write, count--> Board
    firmware --Question--> answer --read, adjust_clock, rng--> Board
    Board --timers, ports--> the functions given to `serve`
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, Final

from firmware_sim.board import Board
from firmware_sim.board_timers import Timer
from firmware_sim.firmware.description import Firmware
from firmware_sim.firmware.errors import FirmwareMistake
from firmware_sim.firmware.host.operations import (
    ACTUATE,
    ADJUST_CLOCK,
    CANCEL,
    COUNT,
    MISTAKE,
    PROMISE,
    SEND,
    SENSE,
    SET_DELAY,
    SET_TIMER,
    Call,
)
from firmware_sim.frame_too_long import tell_frame_too_long
from netem.wire.level import Level

MAX_FRAME_BYTES: Final = 2048       # BOARD_MAX_FRAME_BYTES of marconet_board.h, as all constants here
TIMERS: Final = 32
SILENT: Final = 1
FIRM: Final = 1
NOT_NOW: Final = -2
LATEST_NS: Final = 2**63 - 1        # BOARD_NEVER


class BoardCalls:
    """Carries the calls out; `media`, `read` and `write` have an entry for each port, sensor and actuator.

    `written` has the value that each actuator was given last, 0 before.
    """

    def __init__(self, board: Board, firmware: Firmware, media: Sequence[str],
                 read: Sequence[Callable[[], float | None]], write: Sequence[Callable[[tuple[float]], object]]) -> None:
        self._board, self._firmware = board, firmware
        self.send: list[Callable[[bytes], None]] = [
            board.port(medium, partial(self._receive, number), listen_only=firmware.ports[number].listen_only).send
            for number, medium in enumerate(media)]
        self.read, self.write = list(read), list(write)
        self.written = [0.0] * len(write)
        self._timers: list[Any] = [None] * TIMERS       # a Timer, a number of `_delays`, None: not armed
        self._delays = 0                                # number of delays armed so far
        self._rings: list[Callable[[], None]] = []

    def serve(self, run_timer: Callable[[int], None], run_receive: Callable[[int, bytes], None], data: Any) -> None:
        """Call `run_timer(timer)` when a timer rings, `run_receive(port, frame)` when a frame arrives.

        `data` has the bytes of the frames and texts in the firmware's calls at their places.
        """
        self._run_timer, self._run_receive, self._bytes = run_timer, run_receive, data
        self._rings = [_ring(number, self._timers, run_timer) for number in range(TIMERS)]

    def carry_out(self, calls: Iterable[Call]) -> None:
        for operation, number, integer, place, real in calls:
            if operation == ACTUATE:
                self.written[number] = real
                self.write[number]((real,))
            elif operation == SET_TIMER:
                if self._timers[number] is not None:
                    self._disarm(number)
                self._timers[number] = self._board.at(integer, self._rings[number], sends=not place & SILENT)
            elif operation == SEND:
                if integer < 0:
                    tell_frame_too_long(self._board, self._firmware.ports[number].name, -integer)
                else:
                    self.send[number](self._bytes[place:place + integer].tobytes())
            elif operation == SET_DELAY:
                if self._timers[number] is not None:
                    self._disarm(number)
                self._delays += 1
                self._timers[number] = self._delays
                self._board.after(integer, _delay_ring(number, self._delays, self._timers, self._run_timer),
                                  sends=not place & SILENT)
            elif operation == COUNT:
                self._board.count(self._firmware.counters[number].name, integer)
            elif operation == CANCEL:
                self._disarm(number)
            elif operation == PROMISE:
                (self._board.promise_firm if number & FIRM else self._board.promise_soft)(integer)
            else:
                self._tell(operation, number, bytes(self._bytes[place:place + integer]), int(real))

    def answer(self, question: int, number: int, integer: int, real: float) -> float | None:
        """Return the answer to a question of the firmware; None if the plant has no such value.

        Activations answer SENSE themselves, from `read`.
        """
        if question == SENSE:
            return self.read[number]()
        if question == ADJUST_CLOCK:
            self._board.adjust_clock(integer, real)
            now_ns = self._board.now_ns
            if not -LATEST_NS - 1 <= now_ns <= LATEST_NS:
                raise FirmwareMistake(f"{self._board.name}: {self._firmware.name} called board_adjust_clock({integer}, "
                                      f"{real:g}), after which its clock reads {now_ns} ns: expected a time of 64 bits")
            return real
        return float(self._board.rng.getrandbits(32))

    def disarm_all(self) -> None:
        for timer in range(TIMERS):
            self._disarm(timer)

    def timers_armed(self) -> bool:
        return self._timers.count(None) < TIMERS

    def _receive(self, port: int, data: bytes) -> None:
        if len(data) > MAX_FRAME_BYTES:
            self._board.count("frames too long for the firmware")
            return
        self._run_receive(port, data)

    def _disarm(self, timer: int) -> None:
        armed, self._timers[timer] = self._timers[timer], None
        if isinstance(armed, Timer):
            armed.cancel()

    def _tell(self, operation: int, number: int, text: bytes, code: int) -> None:
        """Record an event; raise FirmwareMistake for a mistake of the firmware."""
        if operation == MISTAKE:
            raise FirmwareMistake(f"{self._board.name}: {self._firmware.name} {_words(text.decode(), number, code)}")
        event = self._firmware.events[number]
        self._board.event(event.name, text.decode(errors="replace"),
                          Level.WARNING if event.level == "warning" else Level.INFO)


def _ring(timer: int, armed: list[Any], run: Callable[[int], None]) -> Callable[[], None]:
    """Return what the board calls when `timer` rings."""
    def ring() -> None:
        armed[timer] = None
        run(timer)

    return ring


def _delay_ring(timer: int, delay: int, armed: list[Any], run: Callable[[int], None]) -> Callable[[], None]:
    """Return what the board calls when the delay of this number is over: `timer` rings unless it was set anew."""
    def ring() -> None:
        if armed[timer] == delay:
            armed[timer] = None
            run(timer)

    return ring


def _words(function: str, number: int, code: int) -> str:
    if code == NOT_NOW:
        return (f"called {function}({number}) within board_start: a board sends nothing before it runs; arm a timer "
                "for board_now() and send from board_timer")
    if "timer" in function or "delay" in function:
        return f"called {function}({number}): timers are numbered 0 to {TIMERS - 1}, BOARD_TIMERS - 1"
    return f"called {function}({number}): no such number in board_ids.h; add a row to firmware.toml"
