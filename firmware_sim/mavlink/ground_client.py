"""The ground's end of a MAVLink link to one vehicle: orders with acknowledgement and retries, targets, what it tells.

    order --COMMAND_LONG--> COMMAND_ACK: done, with its result
             |--`retry_ns` without one--> again with confirmation + 1, up to `attempts` times; then done: unanswered

One order at a time, as the protocol asks for. Heartbeats of a ground station go out once a second, whatever else does.
Nothing here waits: `receive` takes what came in, `due` gives what is to be sent by now.

Source: mavlink.io, command protocol and heartbeat protocol. Not there: parameters, missions, signing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from math import isfinite
from typing import Final

from firmware_sim.autopilot.vehicle import Mode, Vector
from firmware_sim.mavlink.dialect import layout_of, message
from firmware_sim.mavlink.enums import Command, CommandResult, Frame, ModeFlag, PositionIgnore
from firmware_sim.mavlink.link import MavlinkLink, Received
from firmware_sim.mavlink.px4_modes import MAIN_AND_SUB, mode_of_custom

HEARTBEAT_NS: Final = 1_000_000_000
TYPE_GCS, AUTOPILOT_INVALID = 6, 8          # MAV_TYPE, MAV_AUTOPILOT
POSITION_AND_YAW: Final = ~(PositionIgnore.X_IGNORE | PositionIgnore.Y_IGNORE | PositionIgnore.Z_IGNORE
                            | PositionIgnore.YAW_IGNORE | PositionIgnore.FORCE_SET) & 0xFFF


@dataclass
class Told:
    """What the vehicle has told last; times are when it was heard, -1: never."""

    heartbeat_ns: int = -1
    armed: bool = False
    mode: Mode | None = None                    # None: no mode that we know
    position_ns: int = -1
    position_ned_m: Vector = (0.0, 0.0, 0.0)


@dataclass
class Order:
    command: int
    parameters: tuple[float, ...]
    sent: int = 0                               # how often
    sent_ns: int = 0                            # when last


@dataclass
class GroundClient:
    vehicle: tuple[int, int] = (1, 1)           # system, component
    system: int = 255
    component: int = 190
    retry_ns: int = 500_000_000
    attempts: int = 5
    counts: Counter[str] = field(default_factory=Counter)
    on_text: Callable[[int, str], None] = lambda severity, text: None

    def __post_init__(self) -> None:
        if self.retry_ns < 1 or self.attempts < 1:
            raise ValueError(f"retry_ns={self.retry_ns}, attempts={self.attempts}: expected at least 1")
        self.link = MavlinkLink(self.system, self.component, counts=self.counts)
        self.told = Told()
        self.result: CommandResult | None = None        # of the last order that is done; None: unanswered, or other
        self._order: Order | None = None
        self._next_heartbeat_ns = 0

    # --- orders

    @property
    def busy(self) -> bool:
        """An order is under way."""
        return self._order is not None

    def order(self, command: Command, *parameters: float) -> None:
        """Begin an order; it is sent with the next `due`."""
        assert self._order is None, f"{command.name}: an order is under way"
        self._order = Order(command, parameters)

    def set_mode(self, mode: Mode) -> None:
        self.order(Command.DO_SET_MODE, ModeFlag.CUSTOM_MODE_ENABLED, *MAIN_AND_SUB[mode])

    def stream(self, name: str, interval_ns: int) -> None:
        """0: not at all."""
        self.order(Command.SET_MESSAGE_INTERVAL, layout_of(name).id, interval_ns // 1_000 if interval_ns else -1)

    def target(self, position_ned_m: Vector, yaw_rad: float, now_ns: int) -> bytes:
        """Where to be, for OFFBOARD."""
        x, y, z = position_ned_m
        return self.link.send(message(
            "SET_POSITION_TARGET_LOCAL_NED", time_boot_ms=now_ns // 1_000_000 & 0xFFFF_FFFF, x=x, y=y, z=z,
            yaw=yaw_rad, type_mask=POSITION_AND_YAW, coordinate_frame=Frame.LOCAL_NED,
            target_system=self.vehicle[0], target_component=self.vehicle[1]), now_ns)

    # --- the link

    def due(self, now_ns: int) -> list[bytes]:
        """Heartbeat, an order for the first time or again."""
        out = []
        if now_ns >= self._next_heartbeat_ns:
            self._next_heartbeat_ns = now_ns + HEARTBEAT_NS
            out.append(self.link.send(message("HEARTBEAT", type=TYPE_GCS, autopilot=AUTOPILOT_INVALID,
                                              mavlink_version=3), now_ns))
        order = self._order
        if order is not None and (not order.sent or now_ns - order.sent_ns >= self.retry_ns):
            if order.sent == self.attempts:
                self.counts["orders unanswered"] += 1
                self._done(None)
            else:
                out.append(self._send(order, now_ns))
        return out

    def receive(self, data: bytes, now_ns: int) -> None:
        for received in self.link.receive(data, now_ns):
            if (received.system, received.component) == self.vehicle:
                self._hear(received, now_ns)
            else:
                self.counts["frames of others"] += 1

    def _send(self, order: Order, now_ns: int) -> bytes:
        if order.sent:
            self.counts["orders sent again"] += 1
        numbers = {f"param{k}": value for k, value in enumerate(order.parameters, 1)}
        frame = self.link.send(message("COMMAND_LONG", command=order.command, confirmation=order.sent,
                                       target_system=self.vehicle[0], target_component=self.vehicle[1], **numbers),
                               now_ns)
        order.sent += 1
        order.sent_ns = now_ns
        return frame

    def _done(self, result: CommandResult | None) -> None:
        self._order, self.result = None, result

    def _hear(self, received: Received, now_ns: int) -> None:
        told, heard = self.told, received.message
        if heard.name == "HEARTBEAT":
            told.heartbeat_ns = now_ns
            told.armed = bool(heard["base_mode"] & ModeFlag.SAFETY_ARMED)
            told.mode = mode_of_custom(heard["custom_mode"])
        elif heard.name == "LOCAL_POSITION_NED":
            x, y, z = heard["x"], heard["y"], heard["z"]
            if all(map(isfinite, (x, y, z))):
                told.position_ns, told.position_ned_m = now_ns, (x, y, z)
            else:
                self.counts["positions that are not finite"] += 1
        elif heard.name == "STATUSTEXT":
            self.on_text(heard["severity"], heard["text"].decode("utf-8", "replace"))
        elif heard.name == "COMMAND_ACK":
            self._acknowledged(heard["command"], heard["result"])

    def _acknowledged(self, command: int, result: int) -> None:
        order = self._order
        if order is None or order.command != command or not order.sent:
            self.counts["acknowledgements of no order"] += 1
            return
        known = result in CommandResult._value2member_map_
        self._done(CommandResult(result) if known else CommandResult.FAILED)
