"""A robot that agrees with its neighbours over delayed links, by waves or by plain outputs.

    its slot:       measure, broadcast a value for each neighbour
    a frame:        use the value for this robot, set the input anew

It sends in its own slots only, one a round, so its promise to be silent until then is firm. All times are local.

Plant: `linear_system`, input u[1], outputs y[1] and, with waves, y[2], the integral of y[1].
Not modelled: measurement noise, computing time.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, Protocol

from agents.waves.output_coupling import OutputCoupling
from agents.waves.team import read_wave_team
from agents.waves.wave_coupling import WaveCoupling
from agents.waves.wave_frame import WaveFrame
from firmware_sim.board import Board
from firmware_sim.scenario_view import Own, ScenarioView

COUNTERS: Final = ("old frames", "unreadable frames")


class Coupling(Protocol):
    def speak(self) -> list[float]:
        """Return the values of a frame sent now."""

    def hear(self, frame: WaveFrame) -> None:
        """Use the values of a frame that has come; the coupling calls `apply` if the input changes."""

    def control(self) -> float:
        """Return the input of the plant."""


class WaveRobot:
    @staticmethod
    def check(scenario: ScenarioView, own: Own[Any]) -> Iterator[str]:
        """Yield every reason why these robots do not agree, or why it is not known that they do."""
        from agents.waves.preparation import check  # late: a robot's process needs no impairments

        yield from check(scenario, own)

    @staticmethod
    def prepare(scenario: ScenarioView, own: Own[Any]) -> dict[str, Any]:
        """Return the delay of each robot's own value, that of the latest of its neighbours' values."""
        from agents.waves.preparation import prepare

        return prepare(scenario, own)

    def __init__(self, board: Board) -> None:
        team = read_wave_team(board.team)
        self._board, self._codec = board, team.codec
        self._number = team.names.index(board.name)
        self._port = board.port(board.ports[0], self._hear, listen_only=True)
        self._drive = board.actuators(["u[1]"])
        self._control = 0.0
        self._schedule = team.schedule
        for counter in COUNTERS:
            board.count(counter, 0)
        output = board.sensors(["y[1]"])
        board.record_all([("y", "1"), ("u", "1")], lambda: [output.read()[0], self._control])
        kind = WaveCoupling if team.waves else OutputCoupling
        self._coupling: Coupling = kind(board, team, self._number, self._apply)
        self._slot = self._schedule.next_slot_of(self._number, board.now_ns - 1).number
        board.at(board.now_ns, self._apply, sends=False)
        board.at(self._schedule.data_ns(self._slot), self._speak)

    def _speak(self) -> None:
        values = self._coupling.speak()
        self._port.send(self._codec.pack(self._number, self._slot, values))
        self._slot = self._schedule.next_slot_of(self._number, self._board.now_ns, self._slot).number
        self._board.at(self._schedule.data_ns(self._slot), self._speak)

    def _hear(self, data: bytes) -> None:
        frame = self._codec.unpack(data)
        if frame is None or not self._is_possible(frame):
            self._board.count("unreadable frames")
            return
        self._coupling.hear(frame)

    def _is_possible(self, frame: WaveFrame) -> bool:
        """Return whether the slot is one of the sender and has begun, by this clock or one a slot ahead."""
        begun = self._schedule.slot_at(self._board.now_ns).number + 1
        return frame.slot % self._schedule.parts == frame.sender != self._number and frame.slot <= begun

    def _apply(self) -> None:
        self._control = self._coupling.control()
        self._drive.write([self._control])
