"""The mission protocol: upload, download, clear, set current, and progress of the flight.

    upload:  MISSION_COUNT --> request item 0 --item--> request item 1 ... --last item--> MISSION_ACK
             no item within `again_ns`: request it again, after `most_tries` give up; a bad item ends the upload
    download: MISSION_REQUEST_LIST --> MISSION_COUNT; MISSION_REQUEST_INT n --> item n    (the client repeats requests)

The vehicle gets a mission as a whole, with its last item; an upload that does not end changes nothing. If the client
repeats the last item because the MISSION_ACK was lost, it is answered again. Source: mavlink.io, mission protocol.
Fences and rally points are refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from firmware_sim.autopilot.vehicle import MOST_MISSION_ITEMS, MissionItem, Mode, Result, Vehicle
from firmware_sim.mavlink.dialect import Message, message
from firmware_sim.mavlink.enums import MISSION_TYPE_MISSION, MissionResult
from firmware_sim.mavlink.link import Received
from firmware_sim.mavlink.mission_items import as_message, mission_item
from firmware_sim.mavlink.telemetry import Telemetry

RESULTS: Final = {Result.ACCEPTED: MissionResult.ACCEPTED, Result.DENIED: MissionResult.INVALID,
                  Result.UNSUPPORTED: MissionResult.UNSUPPORTED, Result.TEMPORARILY_REJECTED: MissionResult.DENIED,
                  Result.FAILED: MissionResult.ERROR}
REQUEST_OF: Final = {"MISSION_ITEM_INT": "MISSION_REQUEST_INT", "MISSION_ITEM": "MISSION_REQUEST"}
Partner = tuple[int, int, int]          # system, component, port where it was heard


@dataclass
class Upload:
    partner: Partner
    count: int
    asked_ns: int
    tries: int = 1
    items: list[MissionItem] = field(default_factory=list)


@dataclass
class Missions:
    vehicle: Vehicle
    telemetry: Telemetry
    again_ns: int = 500_000_000
    most_tries: int = 10
    event: Callable[[str, str], None] = lambda kind, detail: None
    _upload: Upload | None = field(default=None, init=False)
    _ended: tuple[Partner, int, MissionResult] | None = field(default=None, init=False)
    _flown: int = field(default=-1, init=False)

    def handle(self, received: Received, now_ns: int) -> list[Message]:
        sent, partner = received.message, (received.system, received.component, received.port)
        if sent.name == "MISSION_ACK":
            return []                                   # the client's acknowledgement of a download
        if sent.fields.get("mission_type", MISSION_TYPE_MISSION) != MISSION_TYPE_MISSION:
            return [_ack(partner, MissionResult.UNSUPPORTED, sent["mission_type"])]
        if sent.name == "MISSION_COUNT":
            return self._begin(partner, sent["count"], now_ns)
        if sent.name in REQUEST_OF:
            return self._item(partner, sent, now_ns)
        if sent.name == "MISSION_REQUEST_LIST":
            return [_to(partner, "MISSION_COUNT", count=len(self.vehicle.mission))]
        if sent.name == "MISSION_CLEAR_ALL":
            return [_ack(partner, self._load([]))]
        if sent.name == "MISSION_SET_CURRENT":
            return self._set_current(sent["seq"], now_ns)
        return self._tell_item(partner, sent["seq"])

    def step(self, now_ns: int) -> list[tuple[int | None, Message]]:
        """Return (port, message) due now: repeated requests for items, and MISSION_ITEM_REACHED at every port, None."""
        upload = self._upload
        asked = [] if upload is None else [(upload.partner[2], found) for found in self._ask_again(upload, now_ns)]
        return [*asked, *((None, found) for found in self._reached())]

    def _begin(self, partner: Partner, count: int, now_ns: int) -> list[Message]:
        if self._upload is not None and self._upload.partner != partner:
            return [_ack(partner, MissionResult.DENIED)]
        if count > MOST_MISSION_ITEMS:
            return [_ack(partner, MissionResult.NO_SPACE)]
        self._ended = None
        if count == 0:
            self._upload = None
            return [_ack(partner, self._load([]))]
        self._upload = Upload(partner, count, now_ns)
        return [_to(partner, "MISSION_REQUEST_INT", seq=0)]

    def _item(self, partner: Partner, sent: Message, now_ns: int) -> list[Message]:
        upload = self._upload
        if upload is None or upload.partner != partner:
            if self._ended is not None and self._ended[:2] == (partner, sent["seq"]):
                return [_ack(partner, self._ended[2])]
            return []
        if sent["seq"] != len(upload.items):
            return []                                   # repeated or too early; `step` requests the missing item again
        item = mission_item(sent, upload.items, self.telemetry.origin, self.telemetry.home_ned_m)
        if isinstance(item, MissionResult):
            return self._end(upload, sent["seq"], item)
        upload.items.append(item)
        if len(upload.items) == upload.count:
            return self._end(upload, sent["seq"], self._load(upload.items))
        upload.asked_ns, upload.tries = now_ns, 1
        return [_to(partner, REQUEST_OF[sent.name], seq=len(upload.items))]

    def _end(self, upload: Upload, number: int, result: MissionResult) -> list[Message]:
        self._upload, self._ended = None, (upload.partner, number, result)
        self.event("mission", f"{len(upload.items)} of {upload.count} items: {result.name.lower()}")
        return [_ack(upload.partner, result)]

    def _ask_again(self, upload: Upload, now_ns: int) -> list[Message]:
        if 0 <= now_ns - upload.asked_ns < self.again_ns:
            return []
        if upload.tries >= self.most_tries:
            return self._end(upload, -1, MissionResult.OPERATION_CANCELLED)
        upload.asked_ns, upload.tries = now_ns, upload.tries + 1
        return [_to(upload.partner, "MISSION_REQUEST_INT", seq=len(upload.items))]

    def _load(self, items: list[MissionItem]) -> MissionResult:
        self._flown, self.telemetry.next_item = -1, None
        return RESULTS[self.vehicle.load_mission(items)]

    def choose(self, number: int) -> Result:
        """Continue with item `number`: at once while a mission is flown, otherwise at the next start."""
        if not 0 <= number < len(self.vehicle.mission):
            return Result.DENIED
        if self.vehicle.state().mode is Mode.MISSION:
            return self.start(number)
        self.telemetry.next_item = number
        return Result.ACCEPTED

    def start(self, first: int = 0) -> Result:
        """Start the mission with item `first`, or for 0 with the item that `choose` has set."""
        result = self.vehicle.start_mission(first or self.telemetry.next_item or 0)
        if result is Result.ACCEPTED:
            self._flown, self.telemetry.next_item = -1, None
        return result

    def _set_current(self, number: int, now_ns: int) -> list[Message]:
        self.choose(number)
        current = self.telemetry.build("MISSION_CURRENT", now_ns)
        return [] if current is None else [current]

    def _tell_item(self, partner: Partner, number: int) -> list[Message]:
        mission = self.vehicle.mission
        if number >= len(mission):
            return [_ack(partner, MissionResult.INVALID_SEQUENCE)]
        told = as_message(mission[number], number, number == self.vehicle.state().waypoint_index,
                          self.telemetry.origin, self.telemetry.home_ned_m)
        return [Message(told.name, {**told.fields, "target_system": partner[0], "target_component": partner[1]})]

    def _reached(self) -> list[Message]:
        before, self._flown = self._flown, self.vehicle.state().waypoint_index
        if before < 0:
            return []
        return [message("MISSION_ITEM_REACHED", seq=number) for number in range(before, self._flown)]


def _to(partner: Partner, name: str, **fields: int) -> Message:
    return message(name, target_system=partner[0], target_component=partner[1], mission_type=MISSION_TYPE_MISSION,
                   **fields)


def _ack(partner: Partner, result: MissionResult, mission_type: int = MISSION_TYPE_MISSION) -> Message:
    return message("MISSION_ACK", target_system=partner[0], target_component=partner[1], type=result,
                   mission_type=mission_type)

