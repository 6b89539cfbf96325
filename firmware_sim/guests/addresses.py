"""The loader's check of guests that every kind of guest shares: a plant, a telemetry port, addresses of their own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol, TypeVar

from firmware_sim.guests.telemetry import TelemetrySettings
from firmware_sim.scenario_view import Own


class GuestSettings(Protocol):
    @property
    def listen(self) -> str: ...
    @property
    def telemetry(self) -> TelemetrySettings: ...


Settings = TypeVar("Settings", bound=GuestSettings)


def check_guests(own: Own[Settings], autopilot: str, protocol: str, ports: str) -> Iterator[str]:
    """Yield the reasons why guests of a kind could not take part.

    `protocol` is that of `listen`, "tcp" or "udp"; `ports` says which ports the autopilot's instances use.
    """
    taken: dict[tuple[str, str], str] = {}
    for name, agent in own.items():
        settings = agent.settings
        if not agent.has_plant:
            yield (f'agents.{name}: {autopilot} needs a plant, as plant = {{ fmu = "quadrotor", '
                   'preset = "hummingbird" }')
        try:
            port = settings.telemetry.port_of(agent.media)
        except ValueError as error:
            yield f"agents.{name}.parameters.{error}"
            port = None
        addresses = [("listen", protocol, settings.listen)]
        if port is not None:
            addresses.append(("telemetry.listen", "udp", settings.telemetry.listen))
        for key, kind, address in addresses:
            other = taken.setdefault((kind, address), f"{name}.{key}")
            if other != f"{name}.{key}":
                yield (f"agents.{name}.parameters.{key}={address}: agents.{other.partition('.')[0]} listens there, "
                       f"too; give each vehicle ports of its own ({ports})")
