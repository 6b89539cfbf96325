"""Checks a scenario for the drive controller in C (`firmware_sim/firmware/drive`), as `DriveController` does."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from firmware_sim.drive_controller.drive_controller import DriveController
from firmware_sim.drive_controller.drive_settings import DriveSettings
from firmware_sim.scenario_view import Own, OwnAgent, ScenarioView


class DriveFirmware:
    """The companion of the firmware drive, whose parameters are some of `DriveSettings`."""

    @staticmethod
    def check(scenario: ScenarioView, own: Own[Any]) -> Iterator[str]:
        """Yield the reasons why these drives could not start."""
        drives = {}
        for name, agent in own.items():
            try:
                settings = DriveSettings(**asdict(agent.settings), port="can")
            except ValueError as error:
                yield f"agents.{name}.parameters: {error}"
                continue
            drives[name] = OwnAgent(name, settings, agent.agent)
        yield from DriveController.check(scenario, drives)
