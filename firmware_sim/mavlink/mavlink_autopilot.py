"""The quadrotor's board with MAVLink links: flight controller and front, one plant, motion capture and link ports.

    motion capture --> Autopilot --Vehicle--> MavlinkTask <--> serial lines, radios or gateways

Both run on the same local clock; only the MAVLink task sends frames, at its own releases.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from typing import Any

from simpy.events import Event

from firmware_sim.autopilot.autopilot import NO_PLANT, Autopilot
from firmware_sim.autopilot.autopilot_settings import AutopilotSettings
from firmware_sim.autopilot.vehicle import Severity
from firmware_sim.board import Board
from firmware_sim.mavlink.settings import MavlinkSettings
from firmware_sim.mavlink.task import MavlinkTask
from firmware_sim.scenario_view import Own, ScenarioView


@dataclass(frozen=True)
class MavlinkAutopilotSettings:
    autopilot: AutopilotSettings = field(default_factory=AutopilotSettings)
    mavlink: MavlinkSettings = field(default_factory=MavlinkSettings)


class MavlinkAutopilot:
    Settings = MavlinkAutopilotSettings
    has_execution_time = True

    def __init__(self, board: Board, settings: MavlinkAutopilotSettings) -> None:
        self._board = board
        self.autopilot = Autopilot(board, settings.autopilot)
        self.task = MavlinkTask(board, settings.mavlink.ports_of(board.ports, settings.autopilot.mocap),
                                self.autopilot.controller, settings.mavlink)
        self.autopilot.listeners.append(self._tell_the_ground)      # the autopilot itself records the notice

    def run(self) -> Generator[Event, Any, None]:
        self._board.start(self.task.run())
        yield from self.autopilot.run()

    def _tell_the_ground(self, severity: Severity, text: str) -> None:
        self.task.front.say(severity, text, self._board.now_ns)

    @staticmethod
    def check(scenario: ScenarioView, own: Own[MavlinkAutopilotSettings]) -> Iterator[str]:
        """Yield the reasons why these boards could not start."""
        for name, agent in own.items():
            flight, link = agent.settings.autopilot, agent.settings.mavlink
            try:
                link.ports_of(agent.media, flight.port_of(agent.media))
            except ValueError as error:
                yield f"agents.{name}.parameters: {error}"
            if not agent.has_plant:
                yield f"agents.{name}: {NO_PLANT}"
