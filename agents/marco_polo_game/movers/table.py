"""The movers by the parameter of a sensor that chooses one; a sensor without any moves an omnidirectional plant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from agents.marco_polo_game.movers import MoverSettings
from agents.marco_polo_game.movers.differential_drive import DifferentialDriveSettings
from agents.marco_polo_game.movers.omnidirectional import OmnidirectionalSettings
from agents.marco_polo_game.movers.quadrotor import QuadrotorSettings

MOVERS: Final[Mapping[str, type[MoverSettings]]] = {"drive": DifferentialDriveSettings, "flight": QuadrotorSettings}


@dataclass(frozen=True, kw_only=True)
class PlatformSettings:
    """A field for each of `MOVERS`."""

    drive: DifferentialDriveSettings | None = None
    flight: QuadrotorSettings | None = None

    @property
    def platform(self) -> MoverSettings:
        """Return the settings of the mover that is given; ValueError if there are several."""
        given: dict[str, MoverSettings] = {key: found for key in MOVERS if (found := getattr(self, key)) is not None}
        if len(given) > 1:
            raise ValueError(f"{' and '.join(given)}: a sensor has one platform; keep one of these tables")
        return next(iter(given.values()), OmnidirectionalSettings())
