"""An evader: a robot that one of the motions drives; it sends no frames.

    every hold_ns   motion -> command -> plant

If it has a port `spy`, a sensing medium that delivers every exposure, it takes the nearest body that it detects as its
pursuer, which runners need. It knows its own pose exactly.
Not modelled: sensors, drives and computers of the evader; the plant alone adds lag and limits to the motion.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from math import hypot
from typing import Any, Final

from simpy.events import Event

from agents.pursuit import Place
from agents.pursuit.evader_motions import MOTIONS, Driver
from agents.pursuit.law import Area
from agents.tracking.controller import Pose
from firmware_sim.board import Board
from firmware_sim.scenario_view import Own, ScenarioView
from netem.media.sensing.sight import Detection, unpack_sight
from netem.wire.instants import NEVER_NS

TRUTH: Final = (("x", "m"), ("y", "m"), ("theta", "rad"))
SPY: Final = "spy"


@dataclass(frozen=True)
class EvaderSettings:
    motion: str                                     # one of `MOTIONS`
    v_max_mps: float
    area_x_m: Sequence[float] = (-6.0, 6.0)
    area_y_m: Sequence[float] = (-6.0, 6.0)
    hold_ns: int = 70_000_000                       # period of new commands
    begin_ns: int = 0                               # time of the first command; the robot stands before

    def __post_init__(self) -> None:
        if self.motion not in MOTIONS:
            raise ValueError(f"motion={self.motion!r}: expected one of {', '.join(MOTIONS)}")
        if self.hold_ns < 1:
            raise ValueError(f"hold_ns={self.hold_ns}: expected at least 1")

    @property
    def area(self) -> Area:
        return Area((self.area_x_m[0], self.area_x_m[1]), (self.area_y_m[0], self.area_y_m[1]))


class EvaderRobot:
    Settings = EvaderSettings

    def __init__(self, board: Board, settings: EvaderSettings) -> None:
        self._board, self._settings = board, settings
        self._motion = MOTIONS[settings.motion](Driver(settings.v_max_mps, settings.area, board.rng))
        self._inputs = board.actuators(list(self._motion.INPUTS))
        self._pose = board.sensors([name for name, _ in TRUTH], [unit for _, unit in TRUTH])
        self._seen: tuple[int, Place] | None = None         # (time of the exposure [ns], place of the nearest body)
        for port in board.ports:
            board.port(port, self._spy, listen_only=True)
        board.record_all(TRUTH, self._pose.read)

    @staticmethod
    def check(scenario: ScenarioView, own: Own[EvaderSettings]) -> Iterator[str]:
        """Yield a problem for each evader without a plant and each runner without a medium that shows its pursuer."""
        for name, agent in own.items():
            if MOTIONS[agent.settings.motion].SEES_PURSUER and SPY not in agent.media:
                yield (f"agents.{name}.media: a runner sees its pursuer on a medium {SPY!r} of kind sensing, with "
                       f"every_exposure_to = [{name!r}]")
            if not agent.has_plant:
                yield f"agents.{name}.plant: is missing; an evader drives one: {{ fmu = \"unicycle\" }}"

    def run(self) -> Generator[Event, Any, None]:
        settings = self._settings
        for k in count():
            yield from self._board.sleep_until(settings.begin_ns + k * settings.hold_ns, silent_until_ns=NEVER_NS)
            own = Pose(*self._pose.read())
            self._inputs.write(self._motion.command(k * settings.hold_ns * 1e-9, own, self._seen and self._seen[1]))

    def _spy(self, data: bytes) -> None:
        sight = unpack_sight(data)
        if not isinstance(sight, Detection):
            return
        place, own = (sight.x_m, sight.y_m), self._pose.read()
        if self._seen is not None and self._seen[0] == sight.exposed_ns:
            known = self._seen[1]
            if hypot(known[0] - own[0], known[1] - own[1]) <= hypot(place[0] - own[0], place[1] - own[1]):
                return
        self._seen = sight.exposed_ns, place
