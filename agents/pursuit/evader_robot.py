"""An evader: a robot that is driven by one of the motions, and never says anything.

    every hold_ns   command by the motion -> plant          what `spy` shows: where its pursuer is, for the runner

With a port `spy`, a sensing medium that shows it every exposure, it knows where the nearest body that it sees is. Its
own pose it knows exactly.
Not modelled: its own sensors, drives and computers; only the plant's lag and limits stand between motion and wheels.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from math import hypot
from typing import Any, Final

from simpy.events import Event

from agents.pursuit import Place
from agents.pursuit.evader_motions import MOTIONS, Driver
from agents.pursuit.law import Area
from agents.tracking.controller import Pose
from firmware_sim.board import Board
from firmware_sim.scenario_view import ScenarioView
from netem.media.sensing.sight import Detection, unpack_sight
from netem.wire.instants import NEVER_NS

TRUTH: Final = (("x", "m"), ("y", "m"), ("theta", "rad"))
SPY: Final = "spy"


class EvaderRobot:
    def __init__(self, board: Board, *, motion: str, v_max_mps: float, area_x_m: Sequence[float] = (-6.0, 6.0),
                 area_y_m: Sequence[float] = (-6.0, 6.0), hold_ns: int = 70_000_000, begin_ns: int = 0) -> None:
        """`motion`: see `MOTIONS`; `hold_ns`: how long a command is held; until `begin_ns` it stands."""
        if board.plant is None:
            raise ValueError(f"{board.node.name}: an evader needs a plant")
        if hold_ns < 1:
            raise ValueError(f"hold_ns={hold_ns}: expected at least 1")
        self._board, self._plant, self._hold_ns, self._begin_ns = board, board.plant, hold_ns, begin_ns
        area = Area((area_x_m[0], area_x_m[1]), (area_y_m[0], area_y_m[1]))
        self._motion = MOTIONS[motion](Driver(v_max_mps, area, board.rng))
        self._inputs = self._plant.input_group(list(self._motion.INPUTS))
        self._pose = self._plant.output_group([name for name, _ in TRUTH], [unit for _, unit in TRUTH])
        self._seen: tuple[int, Place] | None = None         # exposure, place of the nearest body
        for port in board.node.ports.values():
            port.on_receive = self._spy
        board.node.signals(TRUTH, self._sample)
        board.node.silent_until(NEVER_NS)

    @staticmethod
    def check(scenario: ScenarioView) -> Iterator[str]:
        """A motion that there is not, a robot without a plant, a runner that cannot see whom it flees."""
        for name, agent in scenario.agents.items():
            if agent.program != f"{EvaderRobot.__module__}:{EvaderRobot.__name__}":
                continue
            motion = agent.parameters.get("motion")
            if motion not in MOTIONS:
                yield f"agents.{name}.parameters.motion={motion!r}: expected one of {', '.join(MOTIONS)}"
            if motion == "runner" and SPY not in agent.media:
                yield (f"agents.{name}.media: a runner sees its pursuer on a medium {SPY!r} of kind sensing, with "
                       f"every_exposure_to = [{name!r}]")
            if agent.plant is None:
                yield f"agents.{name}.plant: is missing; an evader drives one: {{ fmu = \"unicycle\" }}"

    def run(self) -> Generator[Event, Any, None]:
        k = 0
        while True:
            yield from self._board.wait_until(self._begin_ns + k * self._hold_ns)
            own = Pose(*self._sample(self._board.node.now_ns))
            self._inputs.write(self._motion.command(k * self._hold_ns * 1e-9, own, self._seen and self._seen[1]))
            k += 1

    def _sample(self, true_ns: int) -> tuple[float, ...]:
        self._plant.advance_to(true_ns)
        return self._pose.read()

    def _spy(self, data: bytes) -> None:
        sight = unpack_sight(data)
        if not isinstance(sight, Detection):
            return
        place, own = (sight.x_m, sight.y_m), self._sample(self._board.node.now_ns)
        if self._seen is not None and self._seen[0] == sight.exposed_ns:
            known = self._seen[1]
            if hypot(known[0] - own[0], known[1] - own[1]) <= hypot(place[0] - own[0], place[1] - own[1]):
                return
        self._seen = sight.exposed_ns, place
