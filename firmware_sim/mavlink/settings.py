"""The settings of a MAVLink port in a scenario. Times are on the local clock."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from math import isfinite
from types import MappingProxyType
from typing import Final

from firmware_sim.mavlink.geodesy import Origin
from firmware_sim.mavlink.signing import KEY_BYTES, Signing
from firmware_sim.mavlink.telemetry import BUILDERS
from firmware_sim.schedules.periodic import Periodic

SECOND_NS: Final = 1_000_000_000
STREAMS_HZ: Final[Mapping[str, float]] = MappingProxyType({
    "HEARTBEAT": 1.0, "SYS_STATUS": 1.0, "EXTENDED_SYS_STATE": 1.0, "HOME_POSITION": 0.5, "MISSION_CURRENT": 0.5,
    "GPS_RAW_INT": 1.0, "GLOBAL_POSITION_INT": 5.0, "LOCAL_POSITION_NED": 10.0, "ATTITUDE": 5.0,
    "ATTITUDE_QUATERNION": 10.0, "VFR_HUD": 2.0})


@dataclass(frozen=True)
class MavlinkSettings:
    port: str = ""                          # name of the link's port; "": telemetry, or the only other port
    period_ns: int = 5_000_000              # period of the task that serves the link
    offset_ns: int = 0                      # its first release
    execution_ns: int = 200_000             # from a release until its frames are sent
    system: int = 1
    component: int = 1
    receive_buffer_bytes: int = 4096        # bytes received between two releases beyond it are lost
    budget_bytes_per_s: int = 0             # for streams and lists; 0: no limit
    streams_hz: Mapping[str, float] = field(default_factory=dict)      # replaces default rates; 0: off
    latitude_deg: float = Origin.latitude_deg
    longitude_deg: float = Origin.longitude_deg
    altitude_m: float = Origin.altitude_m
    signing_key: str = ""                   # 64 hexadecimal digits; "": nothing is signed
    accept_unsigned: bool = False
    clock_began_s: float = 0.0              # time of the local clock's 0 since 2015-01-01, for signatures

    def __post_init__(self) -> None:
        Periodic(self.period_ns, self.offset_ns).check_execution(self.execution_ns)
        for name in ("system", "component"):
            if not 1 <= getattr(self, name) <= 255:
                raise ValueError(f"{name}={getattr(self, name)}: expected 1 to 255")
        if self.receive_buffer_bytes < 1:
            raise ValueError(f"receive_buffer_bytes={self.receive_buffer_bytes}: expected at least 1")
        if self.budget_bytes_per_s < 0:
            raise ValueError(f"budget_bytes_per_s={self.budget_bytes_per_s}: expected 0 (no limit) or more")
        for name, hertz in self.streams_hz.items():
            if name not in BUILDERS:
                raise ValueError(f"streams_hz: {name}: no such stream; there are {', '.join(sorted(BUILDERS))}")
            if not (isfinite(hertz) and 0 <= hertz <= SECOND_NS / self.period_ns):
                raise ValueError(f"streams_hz: {name}={hertz}: expected 0 to {SECOND_NS / self.period_ns:g}, once a "
                                 "period")
        if not (isfinite(self.clock_began_s) and 0 <= self.clock_began_s < 2.8e9):
            raise ValueError(f"clock_began_s={self.clock_began_s}: expected 0 or more")
        _ = self.origin, self.signing()

    def port_of(self, ports: Collection[str], taken: str) -> str:
        """Return the link's port among those of its node, not the one `taken` by another task.

        Raises ValueError if there is none or no unique one."""
        free = [port for port in ports if port != taken]
        name = self.port or (free[0] if len(free) == 1 else "telemetry")
        if name not in free:
            raise ValueError(f"mavlink.port={name!r}: no such free port; there are {', '.join(free) or 'none'}; "
                             "name the serial line or radio that the ground is on")
        return name

    @property
    def origin(self) -> Origin:
        return Origin(self.latitude_deg, self.longitude_deg, self.altitude_m)

    def signing(self) -> Signing | None:
        """Return a new Signing, which keeps the timestamps accepted; None without a key."""
        if not self.signing_key:
            return None
        try:
            key = bytes.fromhex(self.signing_key)
        except ValueError:
            key = b""
        if len(key) != KEY_BYTES:
            raise ValueError(f"signing_key: expected {2 * KEY_BYTES} hexadecimal digits")
        return Signing(key, clock_began_ticks=round(self.clock_began_s * 1e5), accept_unsigned=self.accept_unsigned)

    def intervals_ns(self) -> dict[str, int]:
        rates = {**STREAMS_HZ, **self.streams_hz}
        return {name: max(self.period_ns, round(SECOND_NS / hertz)) for name, hertz in rates.items() if hertz}
