"""The MAVLink side of a vehicle: takes the bytes that came in at its ports and returns frames to send, without waiting.

    step(bytes by port, now) --> link of the port --> services --> Vehicle          answers go to the port that asked
                                              |--> routing --> other ports

Invariants:
- bytes that are no message for this vehicle change neither the vehicle nor a service;
- heartbeats and answers are sent whatever the budget of their port, and are charged to it.

If the local clock is set back, the streams start anew and all waits end.

Messages addressed to this vehicle, and heartbeats of ground stations and companion computers, keep the link-loss
failsafe from acting, at whichever port they come in; other broadcasts do not.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from firmware_sim.autopilot.vehicle import Severity, Target, Vehicle
from firmware_sim.mavlink import clocks
from firmware_sim.mavlink.dialect import Message
from firmware_sim.mavlink.framing import Frame
from firmware_sim.mavlink.link import MavlinkLink, Received
from firmware_sim.mavlink.missions import Missions
from firmware_sim.mavlink.routing import Routes
from firmware_sim.mavlink.setpoints import attitude_target, position_target
from firmware_sim.mavlink.settings import MavlinkSettings
from firmware_sim.mavlink.streams import Streams
from firmware_sim.mavlink.telemetry import Telemetry
from firmware_sim.mavlink.telemetry_port import TelemetryPort

GROUND_TYPES: Final = (6, 18)           # MAV_TYPE_GCS, MAV_TYPE_ONBOARD_CONTROLLER


class MavlinkFront:
    """`names` are the ports, in the order of `step`; `settings.port_settings` may name them."""

    def __init__(self, vehicle: Vehicle, settings: MavlinkSettings,
                 event: Callable[[str, str], None] = lambda kind, detail: None, *,
                 names: Sequence[str] = ("telemetry",)) -> None:
        self.vehicle, self.event = vehicle, event
        self.counts: Counter[str] = Counter()
        self.telemetry = Telemetry(vehicle, settings.origin)
        self._now_ns = 0
        self._missions = Missions(vehicle, self.telemetry, event=event)
        self._routes = Routes(settings.system, settings.component, len(names))
        signing = settings.signing()
        self.ports = []
        for port, name in enumerate(names):
            link = MavlinkLink(settings.system, settings.component,
                               signing if signing is None or port == 0 else signing.beside(port), self.counts,
                               port=port, on_frame=partial(self._route, port) if len(names) > 1 else None)
            self.ports.append(TelemetryPort(
                link, vehicle, self.telemetry, self._missions, Streams(settings.intervals_ns(name)),
                settings.budget_of(name), settings.period_ns, self._complain, event))
        self._services: list[dict[str, Callable[[Received, int], list[Message]]]] = [{
            **dict.fromkeys(("COMMAND_LONG", "COMMAND_INT"), port.commands.handle),
            **dict.fromkeys(("PARAM_REQUEST_LIST", "PARAM_REQUEST_READ", "PARAM_SET"), port.parameters.handle),
            **dict.fromkeys(("MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM", "MISSION_REQUEST_LIST",
                             "MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT",
                             "MISSION_ACK"), self._missions.handle),
            **dict.fromkeys(("TIMESYNC", "PING"), clocks.answer),
            **dict.fromkeys(("SET_POSITION_TARGET_LOCAL_NED", "SET_ATTITUDE_TARGET"), self._setpoint),
        } for port in self.ports]

    def step(self, heard: Sequence[bytes], now_ns: int) -> list[list[bytes]]:
        """Return the frames to send at each port, in order; `heard` are the bytes of each port since the last call."""
        if now_ns < self._now_ns:
            for port in self.ports:
                port.streams.restart(now_ns)
        self._now_ns = now_ns
        for port, services, data in zip(self.ports, self._services, heard, strict=True):
            for received in port.link.receive(data, now_ns):
                if _speaks_to_us(received):
                    self.vehicle.link_heard(now_ns)
                service = services.get(received.message.name)
                if service is not None:
                    port.answers += service(received, now_ns)
                elif received.message.name != "HEARTBEAT":
                    self.counts["frames not answered"] += 1
        for asker, message in self._missions.step(now_ns):
            for port in self.ports if asker is None else [self.ports[asker]]:
                port.answers.append(message)
        if self.telemetry.watch():
            for name in ("HEARTBEAT", "HOME_POSITION"):
                told = self.telemetry.build(name, now_ns)
                if told is not None:
                    for port in self.ports:
                        port.answers.append(told)
        self.telemetry.messages_lost = self.counts["frames lost"]
        return [port.send(now_ns) for port in self.ports]

    def say(self, severity: Severity, text: str, now_ns: int) -> bool:
        """Queue a text for the operator at every port; return whether any of them will send it."""
        taken = [port.texts.say(severity, text, now_ns) for port in self.ports]
        return any(taken)

    def _route(self, port: int, frame: Frame, message: Message) -> None:
        """Pass on to other ports a frame that came in at `port`."""
        source = frame.system, frame.component
        self._routes.heard(frame.system, frame.component, port)
        for other in self._routes.onward(message.name, source, message.fields, port):
            self.ports[other].passed_on.append(frame.unsigned + frame.signature)
            self.counts["frames passed on"] += 1

    def _setpoint(self, received: Received, now_ns: int) -> list[Message]:
        sent = received.message
        target: Target | str = (attitude_target(sent) if sent.name == "SET_ATTITUDE_TARGET"
                                else position_target(sent, self.vehicle.state()))
        if isinstance(target, str):
            self.counts["setpoints refused"] += 1
            self._complain(Severity.WARNING, target)
            return []
        self.counts["setpoints taken"] += 1
        for what in self.vehicle.target(target, now_ns):
            self.counts["setpoints clipped or refused"] += 1
            self._complain(Severity.WARNING, what)
        return []

    def _complain(self, severity: Severity, text: str) -> None:
        """Report a wrong message to the ground, as a text, and to the record."""
        if self.say(severity, text, self._now_ns):
            self.event("complaint", text)


def _speaks_to_us(received: Received) -> bool:
    sent = received.message
    if sent.name == "HEARTBEAT":
        return sent["type"] in GROUND_TYPES
    return bool(sent.fields.get("target_system"))
