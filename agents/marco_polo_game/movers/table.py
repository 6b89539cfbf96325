"""The movers by the parameter of a sensor that chooses one; a sensor without any moves an omnidirectional plant."""

from __future__ import annotations

from dataclasses import dataclass

from agents.marco_polo_game.movers import MoverSettings
from agents.marco_polo_game.movers.differential_drive import DifferentialDriveSettings
from agents.marco_polo_game.movers.omnidirectional import OmnidirectionalSettings
from agents.marco_polo_game.movers.quadrotor import QuadrotorSettings


@dataclass(frozen=True, kw_only=True)
class PlatformSettings:
    drive: DifferentialDriveSettings | None = None
    flight: QuadrotorSettings | None = None

    @property
    def platform(self) -> MoverSettings:
        """Return the settings of the mover that is given; ValueError if there are several."""
        given: list[MoverSettings] = [each for each in (self.drive, self.flight) if each is not None]
        if len(given) > 1:
            raise ValueError("drive and flight: a sensor has one platform; keep one of both tables")
        return given[0] if given else OmnidirectionalSettings()
