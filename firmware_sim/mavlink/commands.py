"""COMMAND_LONG and COMMAND_INT: each is carried out at once or refused, and answered by one COMMAND_ACK.

A repeated command (`confirmation` > 0, otherwise equal), sent because its answer was lost, is answered again and not
carried out twice. Source: mavlink.io, command protocol; the meaning of numbers as in PX4.

Differs from PX4: no command takes time, so none is answered `IN_PROGRESS`; the altitude of NAV_TAKEOFF is relative to
the place of arming if the frame says so, otherwise above sea level; without one it is the parameter MIS_TAKEOFF_ALT.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Final

from firmware_sim.autopilot.vehicle import Mode, Result, Vehicle
from firmware_sim.mavlink.dialect import Message, message
from firmware_sim.mavlink.enums import FORCE_ARM, Command, CommandResult, Frame, ModeFlag
from firmware_sim.mavlink.link import Received
from firmware_sim.mavlink.missions import Missions
from firmware_sim.mavlink.px4_modes import MODE_OF
from firmware_sim.mavlink.streams import Streams
from firmware_sim.mavlink.telemetry import Telemetry, names

RESULTS: Final = {result: CommandResult[result.name] for result in Result}
RELATIVE: Final = (Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_RELATIVE_ALT_INT)
TAKEOFF_PARAMETER: Final = "MIS_TAKEOFF_ALT"
TAKEOFF_HEIGHT_M: Final = 2.5           # for a vehicle without the parameter MIS_TAKEOFF_ALT
AGAIN_NS: Final = 3_000_000_000         # time within which an equal command is a repetition
US_NS: Final = 1_000
LONGEST_US: Final = 2_147_483_647      # largest interval that MESSAGE_INTERVAL can hold


@dataclass(frozen=True)
class Request:
    command: int
    parameters: tuple[float, ...]       # seven; the fifth and sixth in the units of the message
    frame: int | None                   # of COMMAND_INT; None for COMMAND_LONG
    confirmation: int


@dataclass
class Commands:
    vehicle: Vehicle
    telemetry: Telemetry
    streams: Streams
    missions: Missions
    finest_ns: int                      # shortest interval of a stream
    event: Callable[[str, str], None] = lambda kind, detail: None
    _last: dict[tuple[int, int], tuple[Request, int, CommandResult]] = field(default_factory=dict, init=False)

    def handle(self, received: Received, now_ns: int) -> list[Message]:
        request = _request(received.message)
        sender = received.system, received.component
        extra: list[Message] = []
        last = self._last.get(sender)
        if (last is not None and request.confirmation and _same(request, last[0])
                and 0 <= now_ns - last[1] < AGAIN_NS):
            result = last[2]
        else:
            result, extra = self._carry_out(request, now_ns)
            self._last[sender] = request, now_ns, result
            self.event("command", f"{_name(request.command)} from {sender[0]}/{sender[1]}: {result.name.lower()}")
        return [message("COMMAND_ACK", command=request.command, result=result, target_system=received.system,
                        target_component=received.component), *extra]

    def _carry_out(self, request: Request, now_ns: int) -> tuple[CommandResult, list[Message]]:
        action = ACTIONS.get(request.command)
        if action is not None:
            return RESULTS[action(self, request)], []
        if request.command == Command.SET_MESSAGE_INTERVAL:
            return self._set_interval(request, now_ns), []
        if request.command == Command.GET_MESSAGE_INTERVAL:
            return self._get_interval(request)
        return self._asked_for(request, now_ns)

    # --- for the vehicle

    def arm_disarm(self, request: Request) -> Result:
        wanted, force = request.parameters[0], request.parameters[1] == FORCE_ARM
        if wanted not in (0.0, 1.0):
            return Result.DENIED
        return self.vehicle.arm(force) if wanted else self.vehicle.disarm(force)

    def take_off(self, request: Request) -> Result:
        altitude_m = request.parameters[6]
        if not isfinite(altitude_m):
            return self.vehicle.take_off(self._takeoff_height_m())
        if request.frame in RELATIVE:
            return self.vehicle.take_off(altitude_m)
        return self.vehicle.take_off(altitude_m - self.telemetry.origin.altitude_m + self.telemetry.home_ned_m[2])

    def _takeoff_height_m(self) -> float:
        try:
            return self.vehicle.parameters.get(TAKEOFF_PARAMETER)
        except KeyError:
            return TAKEOFF_HEIGHT_M

    def set_mode(self, request: Request) -> Result:
        flags, main, sub = request.parameters[:3]
        if not all(map(isfinite, (flags, main, sub))) or not int(flags) & ModeFlag.CUSTOM_MODE_ENABLED:
            return Result.DENIED
        mode = MODE_OF.get((int(main), int(sub)))
        if mode is None:
            return Result.UNSUPPORTED
        if mode is Mode.MISSION and self.telemetry.next_item is not None:
            return self.missions.start()
        return self.vehicle.set_mode(mode)

    def start_mission(self, request: Request) -> Result:
        first = request.parameters[0]
        return self.missions.start(int(first)) if isfinite(first) and first >= 0 else Result.DENIED

    def choose_item(self, request: Request) -> Result:
        number = request.parameters[0]
        return self.missions.choose(int(number)) if isfinite(number) else Result.DENIED

    # --- for the link

    def _set_interval(self, request: Request, now_ns: int) -> CommandResult:
        name, interval_us = _message_name(request), request.parameters[1]
        if name is None:
            return CommandResult.UNSUPPORTED
        if not isfinite(interval_us) or not -1 <= interval_us <= LONGEST_US:
            return CommandResult.DENIED
        if interval_us > 0:
            self.streams.set_interval(name, max(self.finest_ns, round(interval_us * US_NS)), now_ns)
        else:
            self.streams.set_interval(name, None if interval_us == 0 else 0, now_ns)
        return CommandResult.ACCEPTED

    def _get_interval(self, request: Request) -> tuple[CommandResult, list[Message]]:
        number, name = request.parameters[0], _message_name(request)
        if not isfinite(number) or not 0 <= number <= 0xFFFF:
            return CommandResult.DENIED, []
        interval_ns = 0 if name is None else self.streams.interval_ns(name)
        interval_us = (interval_ns // US_NS or -1) if name is not None else 0
        return CommandResult.ACCEPTED, [message("MESSAGE_INTERVAL", message_id=int(number), interval_us=interval_us)]

    def _asked_for(self, request: Request, now_ns: int) -> tuple[CommandResult, list[Message]]:
        name = _message_name(request) if request.command == Command.REQUEST_MESSAGE else ASKED.get(request.command)
        if name is None:
            return CommandResult.UNSUPPORTED, []
        found = self.telemetry.build(name, now_ns)
        return (CommandResult.TEMPORARILY_REJECTED, []) if found is None else (CommandResult.ACCEPTED, [found])


ACTIONS: Final[Mapping[int, Callable[[Commands, Request], Result]]] = {
    Command.COMPONENT_ARM_DISARM: Commands.arm_disarm,
    Command.NAV_TAKEOFF: Commands.take_off,
    Command.NAV_LAND: lambda commands, request: commands.vehicle.land(),
    Command.NAV_RETURN_TO_LAUNCH: lambda commands, request: commands.vehicle.set_mode(Mode.RETURN),
    Command.DO_SET_MODE: Commands.set_mode,
    Command.MISSION_START: Commands.start_mission,
    Command.DO_SET_MISSION_CURRENT: Commands.choose_item,
}
ASKED: Final[Mapping[int, str]] = {
    Command.GET_HOME_POSITION: "HOME_POSITION",
    Command.REQUEST_AUTOPILOT_CAPABILITIES: "AUTOPILOT_VERSION",
}


def _request(received: Message) -> Request:
    first = tuple(float(received[f"param{number}"]) for number in range(1, 5))
    if received.name == "COMMAND_INT":
        return Request(received["command"], (*first, float(received["x"]), float(received["y"]), received["z"]),
                       received["frame"], 0)
    return Request(received["command"], (*first, *(received[f"param{number}"] for number in range(5, 8))), None,
                   received["confirmation"])


def _same(request: Request, other: Request) -> bool:
    """Return whether two requests are equal, NaN equal to NaN."""
    return (request.command, request.frame, repr(request.parameters)) == (other.command, other.frame,
                                                                         repr(other.parameters))


def _message_name(request: Request) -> str | None:
    number = request.parameters[0]
    return names().get(int(number)) if isfinite(number) else None


def _name(command: int) -> str:
    try:
        return Command(command).name
    except ValueError:
        return f"command {command}"

