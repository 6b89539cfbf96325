"""Which frames a vehicle passes on from one of its telemetry ports to the others.

    heard from (system, component) at a port     -->  that port is the way to it
    addressed to another system or component     -->  the ports that are the way to it
    broadcast, such as a heartbeat               -->  all other ports, except those that are a way to its source

A frame is passed on as it came, with its sequence number and signature, and never to the port where it came in.
RADIO_STATUS is about the link of one port and stays there.

Source: mavlink.io, routing; ArduPilot, GCS_MAVLink/MAVLink_routing.cpp; PX4, Mavlink::forward_message.
Differs from ArduPilot: every broadcast, not heartbeats only, stays away from the ports where its source was heard, so a
program that is on two ports gets it once, and a link between two ports makes no loop.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

STAYS: Final = ("RADIO_STATUS",)


class Routes:
    def __init__(self, system: int, component: int, ports: int) -> None:
        """`system` and `component` are the vehicle's own."""
        self._own = system, component
        self._ports = range(ports)
        self._ways: dict[tuple[int, int], set[int]] = {}

    def heard(self, system: int, component: int, port: int) -> None:
        """Note that a frame of this source came in at `port`."""
        if system:
            self._ways.setdefault((system, component), set()).add(port)

    def onward(self, name: str, source: tuple[int, int], fields: Mapping[str, Any], port: int) -> list[int]:
        """Return the ports that get the message `name` from `source`, which came in at `port`, in order."""
        if name in STAYS:
            return []
        system, component = fields.get("target_system", 0), fields.get("target_component", 0)
        if not system:
            return [other for other in self._ports if other not in (self._ways.get(source) or ()) and other != port]
        if (system, component) == self._own:
            return []
        found: set[int] = set()
        for (known, part), ways in self._ways.items():
            if known == system and component in (0, part):
                found |= ways
        return sorted(found - {port})
