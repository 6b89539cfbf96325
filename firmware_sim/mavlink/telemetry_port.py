"""One telemetry port of a vehicle: its link, streams, budget, texts and parameter list.

    bytes --> link --> messages to serve           answers, frames passed on --> at once
                                                   texts, streams by how long they waited, parameter list --> in turn

Each port counts sequence numbers of its own and has its own rates, as the channels of ArduPilot and the instances of
PX4 have. Whatever is sent is charged to the budget; heartbeats, answers and frames passed on are sent whatever it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from firmware_sim.autopilot.vehicle import Severity, Vehicle
from firmware_sim.mavlink.commands import Commands
from firmware_sim.mavlink.dialect import Message
from firmware_sim.mavlink.link import MavlinkLink
from firmware_sim.mavlink.missions import Missions
from firmware_sim.mavlink.parameters import ParameterService
from firmware_sim.mavlink.status_texts import StatusTexts
from firmware_sim.mavlink.streams import Budget, Streams
from firmware_sim.mavlink.telemetry import Telemetry


class TelemetryPort:
    def __init__(self, link: MavlinkLink, vehicle: Vehicle, telemetry: Telemetry, missions: Missions, streams: Streams,
                 budget_bytes_per_s: int, period_ns: int, complain: Callable[[Severity, str], None],
                 event: Callable[[str, str], None]) -> None:
        self.link = link
        self.streams = streams
        self.texts = StatusTexts()
        self.parameters = ParameterService(vehicle.parameters, complain, event)
        self.commands = Commands(vehicle, telemetry, streams, missions, period_ns, event)
        self.answers: list[Message] = []            # to send in this period,
        self.passed_on: list[bytes] = []            # after frames from other ports
        self._telemetry = telemetry
        self._budget = Budget(budget_bytes_per_s)
        self._list_first = False
        self._now_ns = 0

    def send(self, now_ns: int) -> list[bytes]:
        """Return the frames of this period, in order, and forget the answers."""
        self._now_ns = now_ns
        self._budget.credit(now_ns)
        out = self.passed_on
        for frame in out:
            self._budget.charge(len(frame))
        out = out + [self._built(message) for message in self.answers]
        self.answers, self.passed_on = [], []
        due = self.streams.due(now_ns)
        if "HEARTBEAT" in due:
            out += [self._built(message) for message in self.content("HEARTBEAT")]
            self.streams.done("HEARTBEAT", now_ns)
            due.remove("HEARTBEAT")
        for message in self._when_there_is_room(due):
            out.append(self._built(message))
        return out

    def content(self, *names: str) -> list[Message]:
        found = (self._telemetry.build(name, self._now_ns) for name in names)
        return [message for message in found if message is not None]

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
            yield from self.content(name)
        if self._budget.credit(now_ns):
            yield from self._next_of_list()

    def _next_of_list(self) -> list[Message]:
        value = self.parameters.next_of_list()
        return [] if value is None else [value]

    def _built(self, message: Message) -> bytes:
        frame = self.link.send(message, self._now_ns)
        self._budget.charge(len(frame))
        return frame
