"""The MAVLink side of a vehicle on one link: takes received bytes and returns frames to send, without waiting.

    step(bytes, now) --> link --> services --> Vehicle
              answers at once; then, as the budget allows: texts, streams by how long they waited, the parameter list

Invariants:
- bytes that are no message for this vehicle change neither the vehicle nor a service;
- heartbeats and answers are sent whatever the budget, and are charged to it.

If the local clock is set back, the streams start anew and all waits end.

Messages addressed to this vehicle, and heartbeats of ground stations and companion computers, keep the link-loss
failsafe from acting; other broadcasts do not.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Final

from firmware_sim.autopilot.vehicle import Severity, Target, Vehicle
from firmware_sim.mavlink import clocks
from firmware_sim.mavlink.commands import Commands
from firmware_sim.mavlink.dialect import Message
from firmware_sim.mavlink.link import MavlinkLink, Received
from firmware_sim.mavlink.missions import Missions
from firmware_sim.mavlink.parameters import ParameterService
from firmware_sim.mavlink.setpoints import attitude_target, position_target
from firmware_sim.mavlink.settings import MavlinkSettings
from firmware_sim.mavlink.status_texts import StatusTexts
from firmware_sim.mavlink.streams import Budget, Streams
from firmware_sim.mavlink.telemetry import Telemetry

GROUND_TYPES: Final = (6, 18)           # MAV_TYPE_GCS, MAV_TYPE_ONBOARD_CONTROLLER


@dataclass
class MavlinkFront:
    vehicle: Vehicle
    settings: MavlinkSettings
    event: Callable[[str, str], None] = lambda kind, detail: None
    counts: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        settings, vehicle = self.settings, self.vehicle
        self.link = MavlinkLink(settings.system, settings.component, settings.signing(), self.counts)
        self.telemetry = Telemetry(vehicle, settings.origin)
        self.streams = Streams(settings.intervals_ns())
        self.texts = StatusTexts()
        self._budget = Budget(settings.budget_bytes_per_s)
        self._now_ns = 0
        self._parameters = ParameterService(vehicle.parameters, self._complain, self.event)
        self._missions = Missions(vehicle, self.telemetry, event=self.event)
        commands = Commands(vehicle, self.telemetry, self.streams, self._missions, settings.period_ns, self.event)
        self._list_first = False
        self._services: dict[str, Callable[[Received, int], list[Message]]] = {
            **dict.fromkeys(("COMMAND_LONG", "COMMAND_INT"), commands.handle),
            **dict.fromkeys(("PARAM_REQUEST_LIST", "PARAM_REQUEST_READ", "PARAM_SET"), self._parameters.handle),
            **dict.fromkeys(("MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ITEM", "MISSION_REQUEST_LIST",
                             "MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT",
                             "MISSION_ACK"), self._missions.handle),
            **dict.fromkeys(("TIMESYNC", "PING"), clocks.answer),
            **dict.fromkeys(("SET_POSITION_TARGET_LOCAL_NED", "SET_ATTITUDE_TARGET"), self._setpoint),
        }

    def step(self, data: bytes, now_ns: int) -> list[bytes]:
        """Return the frames to send, in order; `data` are the bytes received since the last call."""
        if now_ns < self._now_ns:
            self.streams.restart(now_ns)
        self._now_ns = now_ns
        answers: list[Message] = []
        for received in self.link.receive(data, now_ns):
            if _speaks_to_us(received):
                self.vehicle.link_heard(now_ns)
            service = self._services.get(received.message.name)
            if service is not None:
                answers += service(received, now_ns)
            elif received.message.name != "HEARTBEAT":
                self.counts["frames not answered"] += 1
        answers += self._missions.step(now_ns)
        if self.telemetry.watch():
            answers += self._built("HEARTBEAT", "HOME_POSITION")
        self.telemetry.messages_lost = self.counts["frames lost"]
        self._budget.credit(now_ns)
        out = [self._send(message) for message in answers]
        due = self.streams.due(now_ns)
        if "HEARTBEAT" in due:
            out += [self._send(message) for message in self._built("HEARTBEAT")]
            self.streams.done("HEARTBEAT", now_ns)
            due.remove("HEARTBEAT")
        for message in self._when_there_is_room(due):
            out.append(self._send(message))
        return out

    def _when_there_is_room(self, due: list[str]) -> Iterator[Message]:
        """Yield messages to send while the budget has credit: texts, then streams and parameters of a list in turn."""
        now_ns = self._now_ns
        while self._budget.credit(now_ns) and (text := self.texts.next()) is not None:
            yield text
        if self._list_first and self._budget.credit(now_ns):
            self._list_first = False
            yield from self._next_of_list()
        for name in due:
            if not self._budget.credit(now_ns):
                return
            self._list_first = True
            self.streams.done(name, now_ns)
            yield from self._built(name)
        if self._budget.credit(now_ns):
            yield from self._next_of_list()

    def _next_of_list(self) -> list[Message]:
        value = self._parameters.next_of_list()
        return [] if value is None else [value]

    def _built(self, *names: str) -> list[Message]:
        found = (self.telemetry.build(name, self._now_ns) for name in names)
        return [message for message in found if message is not None]

    def _send(self, message: Message) -> bytes:
        frame = self.link.send(message, self._now_ns)
        self._budget.charge(len(frame))
        return frame

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
        if self.texts.say(severity, text, self._now_ns):
            self.event("complaint", text)


def _speaks_to_us(received: Received) -> bool:
    sent = received.message
    if sent.name == "HEARTBEAT":
        return sent["type"] in GROUND_TYPES
    return bool(sent.fields.get("target_system"))
