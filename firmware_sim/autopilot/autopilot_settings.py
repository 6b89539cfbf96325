"""The settings of an autopilot in a scenario."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from firmware_sim.autopilot.airframe import HUMMINGBIRD, Airframe
from firmware_sim.autopilot.parameters import ParameterTable
from firmware_sim.schedules.periodic import Periodic


@dataclass(frozen=True)
class AutopilotSettings:
    """Times are on the local clock."""

    period_ns: int = 1_000_000                  # period of the attitude loop
    offset_ns: int = 0                          # first release
    execution_ns: int = 200_000                 # from a release to its motor commands
    navigation_every: int = 10                  # releases per step of the position loop
    mocap: str = "mocap"                        # name of the port that delivers motion capture
    body: str = ""                              # body tracked there; "": this robot
    airframe: Airframe = HUMMINGBIRD            # the firmware's model of its vehicle; may be given as a mapping
    parameters: Mapping[str, float] = field(default_factory=dict)       # start values of `parameters.py`

    def __post_init__(self) -> None:
        Periodic(self.period_ns, self.offset_ns).check_execution(self.execution_ns)
        if self.navigation_every < 1:
            raise ValueError(f"navigation_every={self.navigation_every}: expected at least 1")
        if isinstance(self.airframe, Mapping):
            object.__setattr__(self, "airframe", Airframe(**self.airframe))
        ParameterTable(self.parameters, lambda: None)

    def port_of(self, ports: Collection[str]) -> str:
        """Return the name of the motion capture port; ValueError if it is not among `ports`."""
        if self.mocap not in ports:
            raise ValueError(f"mocap={self.mocap!r}: no such port; there are {', '.join(ports) or 'none'}; name the "
                             "sensing medium that tells the vehicle where it is")
        return self.mocap
