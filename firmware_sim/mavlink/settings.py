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
class PortSettings:
    """What differs at one of several ports."""

    streams_hz: Mapping[str, float] = field(default_factory=dict)      # replaces rates of all ports; 0: off
    budget_bytes_per_s: int | None = None                              # None: that of all ports


@dataclass(frozen=True)
class MavlinkSettings:
    port: str = ""                          # name of the link's port; "": telemetry, or the only other port
    ports: tuple[str, ...] = ()             # instead, names of several ports
    port_settings: Mapping[str, PortSettings] = field(default_factory=dict)
    period_ns: int = 5_000_000              # period of the task that serves the links
    offset_ns: int = 0                      # its first release
    execution_ns: int = 200_000             # from a release until its frames are sent
    system: int = 1
    component: int = 1
    receive_buffer_bytes: int = 4096        # of each port; bytes received between two releases beyond it are lost
    budget_bytes_per_s: int = 0             # of each port, for streams and lists; 0: no limit
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
        self._check_rates("", self.streams_hz, self.budget_bytes_per_s)
        if self.port and self.ports:
            raise ValueError(f"ports={list(self.ports)}: port = {self.port!r} is given too; keep one")
        if len(set(self.ports)) < len(self.ports):
            raise ValueError(f"ports={list(self.ports)}: a name stands there twice")
        for name, of in self.port_settings.items():
            self._check_rates(f"port_settings: {name}: ", of.streams_hz, of.budget_bytes_per_s or 0)
        if not (isfinite(self.clock_began_s) and 0 <= self.clock_began_s < 2.8e9):
            raise ValueError(f"clock_began_s={self.clock_began_s}: expected 0 or more")
        _ = self.origin, self.signing()

    def _check_rates(self, where: str, streams_hz: Mapping[str, float], budget_bytes_per_s: int) -> None:
        if budget_bytes_per_s < 0:
            raise ValueError(f"{where}budget_bytes_per_s={budget_bytes_per_s}: expected 0 (no limit) or more")
        for name, hertz in streams_hz.items():
            if name not in BUILDERS:
                raise ValueError(f"{where}streams_hz: {name}: no such stream; there are {', '.join(sorted(BUILDERS))}")
            if not (isfinite(hertz) and 0 <= hertz <= SECOND_NS / self.period_ns):
                raise ValueError(f"{where}streams_hz: {name}={hertz}: expected 0 to {SECOND_NS / self.period_ns:g}, "
                                 "once a period")

    def ports_of(self, ports: Collection[str], taken: str) -> list[str]:
        """Return the ports of the links among those of their node, without the one `taken` by another task.

        Raises ValueError if one of them is not there, or if none is named and there is no unique one.
        """
        free = [port for port in ports if port != taken]
        key, names = ("ports", [*self.ports]) if self.ports else (
            "port", [self.port or (free[0] if len(free) == 1 else "telemetry")])
        for name in names:
            if name not in free:
                raise ValueError(f"mavlink.{key}={name!r}: no such free port; there are {', '.join(free) or 'none'}; "
                                 "name the serial line or radio that the ground is on")
        for name in self.port_settings:
            if name not in names:
                raise ValueError(f"mavlink.port_settings.{name}: is none of the ports {', '.join(names)}; correct the "
                                 "name, or add it to ports")
        return names

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

    def budget_of(self, port: str) -> int:
        """Return the bytes per second of a port for streams and lists; 0: no limit."""
        own = self.port_settings[port].budget_bytes_per_s if port in self.port_settings else None
        return self.budget_bytes_per_s if own is None else own

    def intervals_ns(self, port: str) -> dict[str, int]:
        own = self.port_settings[port].streams_hz if port in self.port_settings else {}
        rates = {**STREAMS_HZ, **self.streams_hz, **own}
        return {name: max(self.period_ns, round(SECOND_NS / hertz)) for name, hertz in rates.items() if hertz}
