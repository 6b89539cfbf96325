"""A target of the Marco Polo game: a robot that crosses the area at random, unless a UGV captures it.

    outside --enter_ns--> inside --a leg ends--> inside --at the boundary--> left
                             \\--a UGV grips it--> captured

It waits outside the area, where its plant starts, and is at its entrance at `enter_ns`; when it has left, and when it
is captured, it is taken back there. Both ways take `CARRIED_NS`, in which no camera exposes.

Not modelled: how a target came to the boundary; obstacles; targets that see their pursuers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import pi
from typing import Any, Final

from agents.hybrid.automaton import Automaton, Edge, Mode
from agents.hybrid.modes import Modes
from agents.hybrid.region import All, AnyOf, Between
from agents.marco_polo_game.game_table import game_of
from agents.marco_polo_game.grip_frames import Grip, GripFrame, pack, unpack
from agents.marco_polo_game.target_path import TargetPath
from agents.pursuit import Place
from firmware_sim.board import Board
from firmware_sim.board_timers import Timer
from firmware_sim.scenario_view import Own, ScenarioView

CARRIED_NS: Final = 1_000_000
AT_BOUNDARY_M: Final = 1e-6         # rounding of times to whole ns moves a target by less


@dataclass(frozen=True)
class TargetSettings:
    enter_ns: int
    grip: str = "grip"              # name of the medium on which UGVs capture

    def __post_init__(self) -> None:
        if self.enter_ns <= CARRIED_NS:
            raise ValueError(f"enter_ns={self.enter_ns}: expected more than {CARRIED_NS}, the time from its start "
                             "place to the boundary")


class TargetRobot:
    Settings = TargetSettings

    def __init__(self, board: Board, settings: TargetSettings) -> None:
        self._board = board
        game = game_of(board.team)
        self._number, self._sensors = game.targets.index(board.name), game.sensors
        self._inputs = board.actuators(["v_x_cmd", "v_y_cmd", "omega_cmd"])
        self._pose = board.sensors(["x", "y"], ["m", "m"])
        self._outside: Place = self._place()
        self._path = TargetPath(game.area, game.parameters, board.rng)
        self._captor: int | None = None
        self._timer: Timer | None = None
        self._grip = board.port(settings.grip, self._gripped)
        self._modes = Modes(board, self.automaton(settings, board.team), "outside", self._state)
        for counter in ("entered", "turns", "captured", "left", "unreadable frames"):
            board.count(counter, 0)
        board.record_all([("x", "m"), ("y", "m")], self._pose.read)
        board.at(settings.enter_ns - CARRIED_NS, lambda: self._carry(self._path.leg.place), sends=False)
        self._timer = board.at(settings.enter_ns, self._enter, sends=False)

    @staticmethod
    def automaton(settings: TargetSettings, team: Mapping[str, Any]) -> Automaton:
        game = game_of(team)
        (west, east), (south, north) = game.area.x_m, game.area.y_m
        fast = game.parameters.target_greatest_mps
        inside = All(Between("x", west, east, AT_BOUNDARY_M), Between("y", south, north, AT_BOUNDARY_M))
        at_wall = AnyOf(Between("x", most=west, tolerance=AT_BOUNDARY_M), Between("x", east, tolerance=AT_BOUNDARY_M),
                        Between("y", most=south, tolerance=AT_BOUNDARY_M), Between("y", north, tolerance=AT_BOUNDARY_M))
        return Automaton(
            modes={"outside": Mode(), "inside": Mode(inside, {"x": (-fast, fast), "y": (-fast, fast)}),
                   "left": Mode(), "captured": Mode()},
            edges=[Edge("outside", "inside", at_wall),
                   Edge("inside", "inside", Between("off", -0.5 * pi, 0.5 * pi),
                        apart_ns=game.parameters.turn_least_ns),
                   Edge("inside", "left", at_wall), Edge("inside", "captured")],
            initial={"outside": AnyOf(Between("x", most=west), Between("x", east), Between("y", most=south),
                                      Between("y", north))},
            variables={"x": "m", "y": "m"}, inputs={"off": "rad"})

    @staticmethod
    def check(scenario: ScenarioView, own: Own[TargetSettings]) -> Iterator[str]:
        """Yield a problem for each target that is missing in the team's table, or lacks a plant or the grip medium."""
        try:
            game = game_of(scenario.team)
        except ValueError as error:
            yield str(error)
            return
        for name, agent in own.items():
            if name not in game.targets:
                yield f"team.targets={list(game.targets)}: {name} is missing; frames number the targets by this list"
            if not agent.has_plant:
                yield f"agents.{name}.plant: is missing; a target moves one: {{ fmu = \"omnidirectional\" }}"
            if agent.settings.grip not in agent.media:
                yield f"agents.{name}.media: lacks {agent.settings.grip!r}, on which UGVs capture"

    # --- its way

    def _enter(self) -> None:
        self._modes.change("inside", f"enters at {self._path.leg.speed_mps:.3f} m/s")
        self._board.count("entered")
        self._follow()

    def _follow(self) -> None:
        leg = self._path.leg
        self._inputs.write([*leg.velocity_mps, 0.0])
        self._timer = self._board.at(self._board.now_ns + leg.lasts_ns, self._leave if leg.leaves else self._turn,
                                     sends=False)

    def _turn(self) -> None:
        leg = self._path.turn()
        self._board.count("turns")
        self._modes.change("inside", "turns", inputs={"off": leg.off_rad})
        self._follow()

    def _leave(self) -> None:
        self._board.count("left")
        self._modes.change("left", "at the boundary")
        self._carry(self._outside)

    def _gripped(self, data: bytes) -> None:
        frame = unpack(data)
        if frame is None or frame.sensor >= len(self._sensors):
            self._board.count("unreadable frames")
        elif frame.kind is Grip.GRIPS and frame.target == self._number:
            if self._modes.mode == "inside":
                self._capture(frame.sensor)
            if self._captor is not None:
                self._grip.send(pack(GripFrame(Grip.HELD, self._number, self._captor)))

    def _capture(self, sensor: int) -> None:
        self._captor = sensor
        if self._timer is not None:
            self._timer.cancel()
        self._board.count("captured")
        self._modes.change("captured", "gripped", by=self._sensors[sensor])
        self._carry(self._outside)

    # --- the plant

    def _carry(self, to: Place) -> None:
        x, y = self._place()
        share = 1e9 / CARRIED_NS
        self._inputs.write([(to[0] - x) * share, (to[1] - y) * share, 0.0])
        if self._modes.mode != "outside":
            self._board.at(self._board.now_ns + CARRIED_NS, lambda: self._inputs.write([0.0, 0.0, 0.0]), sends=False)

    def _place(self) -> Place:
        x, y = self._pose.read()
        return float(x), float(y)

    def _state(self) -> dict[str, float]:
        x, y = self._place()
        return {"x": x, "y": y}
