"""The settings of a drive controller in a scenario."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path

from firmware_sim.drive_controller.drive_messages import DRIVE_DBC, UNITS
from firmware_sim.drive_controller.speed_loop import SpeedLoop
from firmware_sim.schedules.periodic import Periodic


@dataclass(frozen=True)
class DriveSettings:
    """Times are on the local clock."""

    period_ns: int = 10_000_000             # period of the speed loop
    offset_ns: int = 0                      # first release
    execution_ns: int = 300_000             # from a release to its outputs
    odometry_every: int = 1                 # releases per publication of odometry
    status_every: int = 10                  # publications of odometry per status
    stale_after_ns: int = 200_000_000       # time without a setpoint after which the drive is stale
    stop_ramp_radps2: float = 20.0          # deceleration of the faster wheel when stopped or stale
    ramp_radps2: float = 0.0                # acceleration of the wheel with the larger change; 0: no limit
    kp: float = 0.5                         # [1]
    ki: float = 5.0                         # [1/s]
    feedforward: float = 1.0                # [1]
    lag_ns: int = 0                         # time constant of a wheel that the loop assumes
    command_max_radps: float = 0.0          # 0: no limit
    counts_per_turn: int = 16_384           # counts of an encoder per turn of the wheel
    unit: int = 0                           # added to every identifier
    port: str = ""                          # "": the port called can, or the only port
    dbc: Path = DRIVE_DBC

    def __post_init__(self) -> None:
        Periodic(self.period_ns, self.offset_ns).check_execution(self.execution_ns)
        for name in ("odometry_every", "status_every", "counts_per_turn"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name}={getattr(self, name)}: expected at least 1")
        if self.stale_after_ns < self.period_ns:
            raise ValueError(f"stale_after_ns={self.stale_after_ns}: expected at least one period of the loop "
                             f"({self.period_ns} ns), which is when silence is noticed")
        if not (isfinite(self.stop_ramp_radps2) and self.stop_ramp_radps2 > 0):
            raise ValueError(f"stop_ramp_radps2={self.stop_ramp_radps2}: expected more than 0, or no drive ever stops")
        for name in ("ramp_radps2", "kp", "ki", "feedforward", "lag_ns", "command_max_radps"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ValueError(f"{name}={getattr(self, name)}: expected 0 or more")
        if not 0 <= self.unit < UNITS:
            raise ValueError(f"unit={self.unit}: expected 0 to {UNITS - 1}, each drive of a bus its own")

    def port_of(self, ports: Collection[str]) -> str:
        """Return the name of the drive's port among those of its node; ValueError if there is none or no unique one."""
        name = self.port or ("can" if "can" in ports or len(ports) != 1 else next(iter(ports)))
        if name not in ports:
            raise ValueError(f"port={name!r}: no such port; there are {', '.join(ports) or 'none'}; name the CAN bus "
                             "that the drive is on")
        return name

    def speed_loop(self) -> SpeedLoop:
        """Return a new speed loop for one wheel."""
        return SpeedLoop(self.kp, self.ki, self.feedforward, self.command_max_radps or inf, self.lag_ns)

    def publication_after(self, release_ns: int) -> int:
        """Return the first release at or after `release_ns`, itself a release, whose odometry is published."""
        number = (release_ns - self.offset_ns) // self.period_ns
        return release_ns + -number % self.odometry_every * self.period_ns
