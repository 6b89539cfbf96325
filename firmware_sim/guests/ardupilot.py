"""ArduPilot's SITL as the guest of a node, in lockstep: our side of its physics interface over JSON and UDP.

    ArduPilot --servo outputs, frame k--> node: motors; one step of 1 / frame_rate --state, its time--> ArduPilot

ArduPilot waits for the state before it computes frame k + 1, so its time is the node's local clock. It sends a frame
again if the answer is late; such a copy gets the last answer again, and no second step. A frame number that goes back
means that the vehicle was reset, which is an event. Its sensors' noise is its own (parameters SIM_*).

Not modelled: range finders, wind, RC input, 32 channels beyond the sixteenth. Nothing here has met a real ArduPilot:
docs/guests.md.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from math import isfinite
from typing import ClassVar, Final

from simpy.events import Event

from firmware_sim.board import Board
from firmware_sim.guests.addresses import check_guests
from firmware_sim.guests.ardupilot_frames import Servos, read_servos, state_text
from firmware_sim.guests.body import Body, MotorSettings
from firmware_sim.guests.door import Datagrams, GuestFailure, loopback_address, seconds_left
from firmware_sim.guests.telemetry import Telemetry, TelemetrySettings
from firmware_sim.scenario_view import Own, ScenarioView

SECOND_NS: Final = 1_000_000_000
LARGEST_TIME_STEP_S: Final = 0.1            # ArduPilot ignores the time of a state that is further ahead


@dataclass(frozen=True)
class ArduPilotSettings:
    """Times that end in `_s` are of the wall clock."""

    listen: str = "127.0.0.1:9002"          # ArduPilot sends to 9002 + 10 times its instance
    connect_within_s: float = 25.0          # for its first frame
    answer_within_s: float = 10.0           # for each of the others
    motors: MotorSettings = field(default_factory=MotorSettings)
    telemetry: TelemetrySettings = field(default_factory=TelemetrySettings)

    def __post_init__(self) -> None:
        loopback_address("listen", self.listen)
        for name in ("connect_within_s", "answer_within_s"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name}={getattr(self, name)}: expected more than 0 seconds")


class ArduPilotGuest:
    Settings: ClassVar = ArduPilotSettings

    def __init__(self, board: Board, settings: ArduPilotSettings) -> None:
        self._board, self._settings = board, settings
        self._name = f"agents.{board.name}"
        self._body = Body(board, settings.motors)
        self._telemetry = Telemetry(board, settings.telemetry)
        self._socket = Datagrams(self._name, loopback_address("listen", settings.listen), "listen")
        board.at_end(self._socket.close)
        self._last: Servos | None = None
        self._answer = b""                  # to the last frame
        for counter in ("steps", "frames repeated", "frames lost", "unreadable datagrams"):
            board.count(counter, 0)

    def run(self) -> Generator[Event, None, None]:
        board = self._board
        while True:
            servos = self._next()
            self._body.drive(servos.commands())
            board.count("steps")
            self._telemetry.pass_on()
            yield from board.sleep_until(board.now_ns + SECOND_NS // servos.rate_hz)
            self._answer = state_text(self._body.read(), board.now_ns / SECOND_NS)
            self._socket.send(self._answer)

    def _next(self) -> Servos:
        """Wait for the next frame."""
        before = self._last
        within_s = self._settings.answer_within_s if before else self._settings.connect_within_s
        until_s = time.monotonic() + within_s
        while (data := self._socket.receive(until_s)) is not None:
            servos = read_servos(data)
            if servos is None or servos.rate_hz * LARGEST_TIME_STEP_S < 1:
                self._board.count("unreadable datagrams")
                if not seconds_left(until_s):
                    break                   # somebody floods the socket with other things
            elif before is not None and servos.count == before.count:
                self._board.count("frames repeated")
                self._socket.send(self._answer)
            else:
                self._note_gap(before, servos)
                self._last = servos
                return servos
        raise GuestFailure(f"{self._name}: no frame of servo outputs from ArduPilot on {self._settings.listen} within "
                           f"{within_s:g} s; " + ("is it stopped?" if before else
                           "start it with --model JSON:127.0.0.1, or give it more time by `connect_within_s`"))

    def _note_gap(self, before: Servos | None, now: Servos) -> None:
        if before is None:
            self._telemetry.begin()
            self._board.event("guest connected", f"ArduPilot at {now.rate_hz} Hz")
        elif now.count < before.count:
            self._board.warn("guest reset", f"ArduPilot counts frames from {now.count} again, after {before.count}")
        elif now.count > before.count + 1:
            self._board.count("frames lost", now.count - before.count - 1)

    @staticmethod
    def check(scenario: ScenarioView, own: Own[ArduPilotSettings]) -> Iterator[str]:
        """Yield the reasons why these guests could not take part."""
        yield from check_guests(own, "ArduPilot", "udp", "ArduPilot's instance N uses 9002 + 10 N")
