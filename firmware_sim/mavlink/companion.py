"""The companion computer's end of the link: latest telemetry, commands repeated until they are answered, targets.

    hear(bytes) --> latest telemetry, answers        step(now) --> heartbeat each second, unanswered commands again
    command(...)  --> one at a time, in order; repeated with `confirmation` counting up, given up after `most_tries`

It returns bytes and never waits; the program sends them, and calls `step` at least every `again_ns`.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from math import isfinite, nan
from typing import Final

from firmware_sim.autopilot.vehicle import Mode, PositionTarget, Quaternion, Vector
from firmware_sim.mavlink.dialect import Message, message
from firmware_sim.mavlink.enums import Command, CommandResult, Frame, ModeFlag, PositionIgnore
from firmware_sim.mavlink.link import MavlinkLink
from firmware_sim.mavlink.px4_modes import MAIN_AND_SUB, mode_of_custom
from firmware_sim.mavlink.setpoints import ACCELERATIONS, AXES, SPEEDS

TYPE_ONBOARD_CONTROLLER: Final = 18     # MAV_TYPE
AUTOPILOT_INVALID: Final = 8           # MAV_AUTOPILOT: no autopilot
HEARTBEAT_NS: Final = 1_000_000_000
AUTOPILOT_COMPONENT: Final = 1


@dataclass
class Asked:
    command: Command
    parameters: tuple[float, ...]
    sent_ns: int | None = None
    tries: int = 0


@dataclass
class Companion:
    link: MavlinkLink
    vehicle: int = 1                    # its system number
    again_ns: int = 500_000_000
    most_tries: int = 10
    armed: bool = False
    mode: Mode | None = None            # None: no heartbeat yet, or an unknown mode
    heartbeat_ns: int = -1              # time of the last heartbeat; -1: none yet
    landed_state: int = 0               # MAV_LANDED_STATE
    position_ned_m: Vector | None = None
    velocity_ned_mps: Vector | None = None
    quaternion_wxyz: Quaternion | None = None
    answers: list[tuple[Command, CommandResult | None]] = field(default_factory=list)   # None: given up
    texts: list[str] = field(default_factory=list)
    _asked: deque[Asked] = field(default_factory=deque, init=False)
    _heartbeat_ns: int = field(default=0, init=False)

    def hear(self, data: bytes, now_ns: int) -> list[Message]:
        """Take received bytes; return the vehicle's messages in them, already applied to the attributes."""
        told = [received.message for received in self.link.receive(data, now_ns) if received.system == self.vehicle]
        for found in told:
            self._note(found, now_ns)
        return told

    @property
    def waits(self) -> bool:
        """Whether a command has no answer yet."""
        return bool(self._asked)

    def command(self, command: Command, *parameters: float) -> None:
        self._asked.append(Asked(command, (*parameters, *(0.0,) * (7 - len(parameters)))))

    def set_mode(self, mode: Mode) -> None:
        main, sub = MAIN_AND_SUB[mode]
        self.command(Command.DO_SET_MODE, ModeFlag.CUSTOM_MODE_ENABLED, main, sub)

    def take_off(self, altitude_m: float = nan) -> None:
        """Command a take-off to `altitude_m` above sea level; nan: to the vehicle's parameter MIS_TAKEOFF_ALT."""
        self.command(Command.NAV_TAKEOFF, *(nan,) * 6, altitude_m)

    def step(self, now_ns: int) -> list[bytes]:
        """Return the frames to send now: a heartbeat if due, the current command if due."""
        out = []
        if now_ns >= self._heartbeat_ns:
            self._heartbeat_ns = now_ns + HEARTBEAT_NS
            beat = message("HEARTBEAT", type=TYPE_ONBOARD_CONTROLLER, autopilot=AUTOPILOT_INVALID, mavlink_version=3)
            out.append(self.link.send(beat, now_ns))
        while self._asked:
            asked = self._asked[0]
            if asked.sent_ns is not None and now_ns - asked.sent_ns < self.again_ns:
                break
            if asked.tries < self.most_tries:
                out.append(self.link.send(self._command_long(asked), now_ns))
                asked.sent_ns, asked.tries = now_ns, asked.tries + 1
                break
            self.answers.append((asked.command, None))
            self._asked.popleft()
        return out

    def target(self, target: PositionTarget, now_ns: int) -> bytes:
        """Return a frame with `target`, in coordinates of LOCAL_NED."""
        mask = ACCELERATIONS
        for axes, bits in ((target.position_ned_m, AXES), (target.velocity_ned_mps, SPEEDS)):
            for value, bit in zip(axes, bits, strict=True):
                mask |= bit if value is None else PositionIgnore(0)
        mask |= PositionIgnore.YAW_IGNORE if target.yaw_rad is None else PositionIgnore(0)
        mask |= PositionIgnore.YAW_RATE_IGNORE if target.yaw_rate_radps is None else PositionIgnore(0)
        x, y, z = (value or 0.0 for value in target.position_ned_m)
        vx, vy, vz = (value or 0.0 for value in target.velocity_ned_mps)
        return self.link.send(message(
            "SET_POSITION_TARGET_LOCAL_NED", time_boot_ms=now_ns // 1_000_000 & 0xFFFF_FFFF, type_mask=mask,
            target_system=self.vehicle, target_component=AUTOPILOT_COMPONENT, coordinate_frame=Frame.LOCAL_NED, x=x,
            y=y, z=z, vx=vx, vy=vy, vz=vz, yaw=target.yaw_rad or 0.0, yaw_rate=target.yaw_rate_radps or 0.0), now_ns)

    def _command_long(self, asked: Asked) -> Message:
        values = {f"param{number}": value for number, value in enumerate(asked.parameters, 1)}
        return message("COMMAND_LONG", target_system=self.vehicle, target_component=AUTOPILOT_COMPONENT,
                       command=asked.command, confirmation=min(asked.tries, 255), **values)

    def _note(self, told: Message, now_ns: int) -> None:
        if told.name == "HEARTBEAT":
            self.armed = bool(told["base_mode"] & ModeFlag.SAFETY_ARMED)
            self.mode = mode_of_custom(told["custom_mode"])
            self.heartbeat_ns = now_ns
        elif told.name == "LOCAL_POSITION_NED" and not all(map(isfinite, (told["x"], told["y"], told["z"]))):
            self.link.counts["positions that are not finite"] += 1
        elif told.name == "LOCAL_POSITION_NED":
            self.position_ned_m = told["x"], told["y"], told["z"]
            self.velocity_ned_mps = told["vx"], told["vy"], told["vz"]
        elif told.name == "ATTITUDE_QUATERNION":
            self.quaternion_wxyz = told["q1"], told["q2"], told["q3"], told["q4"]
        elif told.name == "EXTENDED_SYS_STATE":
            self.landed_state = told["landed_state"]
        elif told.name == "STATUSTEXT":
            self.texts.append(told["text"].decode("ascii", "replace"))
        elif told.name == "COMMAND_ACK" and self._asked and told["command"] == self._asked[0].command:
            self.answers.append((self._asked.popleft().command, _result(told["result"])))


def _result(number: int) -> CommandResult:
    try:
        return CommandResult(number)
    except ValueError:
        return CommandResult.FAILED
