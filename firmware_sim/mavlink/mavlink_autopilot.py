"""The quadrotor's board with a MAVLink link: flight controller and front, one plant, motion capture and one link port.

    motion capture --> Autopilot --Vehicle--> MavlinkTask <--> serial line, radio or gateway

Both run on the same local clock; only the front hands anything out, at its own releases.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from dataclasses import fields
from typing import Any, Final

from simpy.events import Event

from firmware_sim.autopilot.autopilot import NO_PLANT, Autopilot
from firmware_sim.autopilot.autopilot_settings import AutopilotSettings
from firmware_sim.autopilot.vehicle import Severity
from firmware_sim.board import Board
from firmware_sim.mavlink.settings import MavlinkSettings
from firmware_sim.mavlink.task import MavlinkTask
from firmware_sim.scenario_view import ScenarioView

AUTOPILOT: Final = AutopilotSettings()
MAVLINK: Final = MavlinkSettings()


class MavlinkAutopilot:
    def __init__(self, board: Board, *, autopilot: AutopilotSettings = AUTOPILOT,
                 mavlink: MavlinkSettings = MAVLINK) -> None:
        """Both may also be mappings with the fields of their classes, as they come out of a scenario."""
        flight, link = _built(autopilot, mavlink)
        self._board = board
        self.autopilot = Autopilot(board, **{item.name: getattr(flight, item.name) for item in fields(flight)})
        self.task = MavlinkTask(board, link.port_of(board.node.ports, flight.mocap), self.autopilot.controller, link)
        self.autopilot.listeners.append(self._tell_the_ground)      # the event of it is the autopilot's own

    def run(self) -> Generator[Event, Any, None]:
        self._board.node.start(self.task.run())
        yield from self.autopilot.run(silent=False)

    def _tell_the_ground(self, severity: Severity, text: str) -> None:
        self.task.front.texts.say(severity, text, self._board.now_ns)

    @staticmethod
    def check(scenario: ScenarioView) -> Iterator[str]:
        """What no such board could start with."""
        for name, agent in scenario.agents.items():
            if agent.program != f"{MavlinkAutopilot.__module__}:{MavlinkAutopilot.__name__}":
                continue
            try:
                flight, link = _built(agent.parameters.get("autopilot", AUTOPILOT),
                                      agent.parameters.get("mavlink", MAVLINK))
                link.port_of(agent.media, flight.port_of(agent.media))
            except ValueError as error:
                yield f"agents.{name}.parameters: {error}"
            if agent.plant is None:
                yield f"agents.{name}: {NO_PLANT}"


def _built(autopilot: AutopilotSettings | Mapping[str, Any],
           mavlink: MavlinkSettings | Mapping[str, Any]) -> tuple[AutopilotSettings, MavlinkSettings]:
    return (AutopilotSettings(**autopilot) if isinstance(autopilot, Mapping) else autopilot,
            MavlinkSettings(**mavlink) if isinstance(mavlink, Mapping) else mavlink)
