"""A target of the Marco Polo game: a robot that crosses the area at random, unless a UGV captures it.

    outside --enter_ns--> inside --a leg ends--> inside --at the boundary--> left
                           |  ^                     \\--a UGV grips it--> captured
             at an obstacle v  | a leg ends
                          avoiding --at an obstacle--> avoiding           and from there to left and captured as well

T_min is the least time between turns that the target makes of itself, and from one at an obstacle to the next of those.
It waits outside the area, where its plant starts, and is at its entrance at `enter_ns`; when it has left, and when it
is captured, it is taken back there. Both ways take `CARRIED_NS`, in which no camera exposes. It answers a grip N^D + 1
times, `ANSWERS_APART_NS` apart, so that N^D losses in a row do not leave its captor in doubt.

Not modelled: how a target came to the boundary; targets that see their pursuers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import dist, pi
from typing import Any, Final

from agents.hybrid.automaton import Automaton, Edge, Mode
from agents.hybrid.modes import Modes
from agents.hybrid.region import All, AnyOf, Between, Where
from agents.marco_polo.convex_polygon import ConvexPolygon
from agents.marco_polo_game.game_table import Game, game_of
from agents.marco_polo_game.grip_frames import Grip, Held, pack, unpack
from agents.marco_polo_game.target_path import Ending, TargetPath
from agents.pursuit import Place
from firmware_sim.board import Board
from firmware_sim.board_timers import Timer
from firmware_sim.scenario_view import Own, ScenarioView

CARRIED_NS: Final = 1_000_000
AT_BOUNDARY_M: Final = 1e-6         # rounding of times to whole ns moves a target by less; of obstacles as well
ANSWERS_APART_NS: Final = 5_000_000
CLEAR_OF_VIEWS_M: Final = 0.1       # of the place that is named for a target that a sensor would see while it waits
UNDER_WAY: Final = ("inside", "avoiding")


@dataclass(frozen=True)
class TargetSettings:
    enter_ns: int
    grip: str = "grip"              # name of the medium on which UGVs capture
    max_successive_losses: int = 0  # N^D, on the grip medium

    def __post_init__(self) -> None:
        if self.enter_ns <= CARRIED_NS:
            raise ValueError(f"enter_ns={self.enter_ns}: expected more than {CARRIED_NS}, the time from its start "
                             "place to the boundary")
        if self.max_successive_losses < 0:
            raise ValueError(f"max_successive_losses={self.max_successive_losses}: expected at least 0")


class TargetRobot:
    Settings = TargetSettings

    def __init__(self, board: Board, settings: TargetSettings) -> None:
        self._board = board
        game = game_of(board.team)
        self._number, self._sensors = game.targets.index(board.name), game.sensors
        self._capture_m, self._answers = game.parameters.capture_m, settings.max_successive_losses + 1
        self._inputs = board.actuators(["v_x_cmd", "v_y_cmd", "omega_cmd"])
        self._pose = board.sensors(["x", "y"], ["m", "m"])
        self._outside: Place = self._place()
        self._path = TargetPath(game.area, game.parameters, board.rng, game.obstacles)
        self._captor: int | None = None
        self._timer: Timer | None = None
        self._answer_timer: Timer | None = None
        self._grip = board.port(settings.grip, self._gripped)
        self._modes = Modes(board, self.automaton(settings, board.team), "outside", self._state)
        for counter in ("entered", "turns", "turns at obstacles", "captured", "left", "grips out of reach",
                        "unreadable frames"):
            board.count(counter, 0)
        board.record_all([("x", "m"), ("y", "m")], self._pose.read)
        board.at(settings.enter_ns - CARRIED_NS, lambda: self._carry(self._path.leg.place), sends=False)
        self._timer = board.at(settings.enter_ns, self._enter, sends=False)

    @staticmethod
    def automaton(settings: TargetSettings, team: Mapping[str, Any]) -> Automaton:
        game = game_of(team)
        (west, east), (south, north) = game.area.x_m, game.area.y_m
        parameters, obstacles = game.parameters, [ConvexPolygon(corners) for corners in game.obstacles]
        fast = parameters.target_greatest_mps
        outside_obstacles = Where("outside the obstacles", ("x", "y"), lambda point: all(
            obstacle.depth_m((point["x"], point["y"])) <= AT_BOUNDARY_M for obstacle in obstacles))
        at_obstacle = Where("at an obstacle", ("x", "y"), lambda point: any(
            abs(obstacle.depth_m((point["x"], point["y"]))) <= AT_BOUNDARY_M for obstacle in obstacles))
        inside = All(Between("x", west, east, AT_BOUNDARY_M), Between("y", south, north, AT_BOUNDARY_M),
                     *([outside_obstacles] if obstacles else ()))
        at_wall = AnyOf(Between("x", most=west, tolerance=AT_BOUNDARY_M), Between("x", east, tolerance=AT_BOUNDARY_M),
                        Between("y", most=south, tolerance=AT_BOUNDARY_M), Between("y", north, tolerance=AT_BOUNDARY_M))
        moving = Mode(inside, {"x": (-fast, fast), "y": (-fast, fast)})
        within_half_plane = Between("off", -0.5 * pi, 0.5 * pi)
        free_ns = min(parameters.turn_least_ns, int(parameters.platform_m / fast * 1e9))    # after an obstacle
        return Automaton(
            modes={"outside": Mode(), "inside": moving, "avoiding": moving, "left": Mode(), "captured": Mode()},
            edges=[Edge("outside", "inside", at_wall),
                   Edge("inside", "inside", within_half_plane, apart_ns=parameters.turn_least_ns),
                   Edge("inside", "avoiding", at_obstacle),
                   Edge("avoiding", "avoiding", at_obstacle, apart_ns=free_ns),
                   Edge("avoiding", "inside", within_half_plane, apart_ns=parameters.turn_least_ns),
                   *(Edge(mode, "left", at_wall) for mode in UNDER_WAY),
                   *(Edge(mode, "captured") for mode in UNDER_WAY)],
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
            else:
                yield from _seen_while_it_waits(game, name, agent.agent.plant)
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
        self._timer = self._board.at(self._board.now_ns + leg.lasts_ns,
                                     self._leave if leg.ending is Ending.LEAVES else self._turn, sends=False)

    def _turn(self) -> None:
        avoids = self._path.leg.ending is Ending.AVOIDS
        leg = self._path.turn()
        self._board.count("turns at obstacles" if avoids else "turns")
        self._modes.change("avoiding" if avoids else "inside", "turns at an obstacle" if avoids else "turns",
                           inputs={"off": leg.off_rad})
        self._follow()

    def _leave(self) -> None:
        self._board.count("left")
        self._modes.change("left", "at the boundary")
        self._carry(self._outside)

    def _gripped(self, data: bytes) -> None:
        frame = unpack(data)
        if frame is None or frame.sensor >= len(self._sensors):
            self._board.count("unreadable frames")
        elif isinstance(frame, Grip) and frame.target == self._number:
            if self._modes.mode in UNDER_WAY and self._in_reach(frame):
                self._capture(frame.sensor)
            if self._captor is not None:
                self._answer(self._captor, self._answers)

    def _in_reach(self, grip: Grip) -> bool:
        if dist(self._place(), (grip.x_m, grip.y_m)) <= self._capture_m:
            return True
        self._board.count("grips out of reach")
        return False

    def _answer(self, captor: int, times: int) -> None:
        """Say who has captured this target, `times` from now on, in place of answers that are left of an earlier grip.
        """
        if self._answer_timer is not None:
            self._answer_timer.cancel()
        self._grip.send(pack(Held(self._number, captor)))
        self._answer_timer = None if times == 1 else self._board.at(
            self._board.now_ns + ANSWERS_APART_NS, lambda: self._answer(captor, times - 1))

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


def _seen_while_it_waits(game: Game, name: str, plant: Any) -> Iterator[str]:
    """Yield a problem if a sensor can see the start of a target, from some place in the area."""
    (west, east), (south, north), most_m = game.area.x_m, game.area.y_m, max(game.radius_m.values())
    x, y = place = float(plant.parameters.get("x", 0.0)), float(plant.parameters.get("y", 0.0))
    if dist(place, game.area.nearest(place)) <= most_m:
        away_m = most_m + CLEAR_OF_VIEWS_M
        near = min(((west - away_m, y), (east + away_m, y), (x, south - away_m), (x, north + away_m)),
                   key=lambda other: dist(place, other))
        yield (f"agents.{name}=({x:g}, {y:g}) m: a target waits where no sensor sees it, more than {most_m:g} m "
               f"outside the area; the nearest place that would do is ({near[0]:g}, {near[1]:g}) m, move it there")
