"""Converts mission items of MAVLink to the vehicle's items and back.

    NAV_TAKEOFF, NAV_WAYPOINT, NAV_LAND, NAV_RETURN_TO_LAUNCH, in the frames GLOBAL, GLOBAL_RELATIVE_ALT (each also as
    _INT) and LOCAL_NED; relative heights are above the place where the vehicle was armed last

Downloaded items have the frame GLOBAL_RELATIVE_ALT_INT, with the same numbers if they were uploaded in it. A landing at
latitude and longitude 0 is a landing at the position of the item before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, isfinite, nan, radians, remainder
from typing import Final

from firmware_sim.autopilot.vehicle import ItemKind, MissionItem, Vector
from firmware_sim.mavlink.dialect import Message, message
from firmware_sim.mavlink.enums import MISSION_TYPE_MISSION, Command, Frame, MissionResult
from firmware_sim.mavlink.geodesy import E7, Origin

KINDS: Final = {Command.NAV_TAKEOFF: ItemKind.TAKEOFF, Command.NAV_WAYPOINT: ItemKind.WAYPOINT,
                Command.NAV_LAND: ItemKind.LAND, Command.NAV_RETURN_TO_LAUNCH: ItemKind.RETURN}
COMMAND_OF: Final = {kind: command for command, kind in KINDS.items()}
ABSOLUTE: Final = (Frame.GLOBAL, Frame.GLOBAL_INT)
RELATIVE: Final = (Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_RELATIVE_ALT_INT)
FARTHEST_M: Final = 100_000.0           # largest distance from the origin, since the map is flat


def mission_item(sent: Message, before: Sequence[MissionItem], origin: Origin,
                 home_ned_m: Vector) -> MissionItem | MissionResult:
    """Return the item of MISSION_ITEM_INT or MISSION_ITEM, which follows those of `before`, or why it is refused."""
    kind = KINDS.get(sent["command"])
    if kind is None:
        return MissionResult.UNSUPPORTED
    hold_s, acceptance_m, yaw_deg = sent["param1"], sent["param2"], sent["param4"]
    if kind is ItemKind.RETURN:
        return MissionItem(kind, (0.0, 0.0, 0.0))
    position = _position(sent, kind, before, origin, home_ned_m)
    if isinstance(position, MissionResult):
        return position
    if max(map(abs, position)) > FARTHEST_M:
        return MissionResult.INVALID
    if kind is not ItemKind.WAYPOINT:
        hold_s = acceptance_m = 0.0
    if not (isfinite(hold_s) and hold_s >= 0 and isfinite(acceptance_m) and acceptance_m >= 0):
        return MissionResult.INVALID
    yaw_rad = radians(remainder(yaw_deg, 360)) if isfinite(yaw_deg) else None
    return MissionItem(kind, position, hold_s, acceptance_m, yaw_rad)


def as_message(item: MissionItem, number: int, current: bool, origin: Origin, home_ned_m: Vector) -> Message:
    north, east, down = item.position_ned_m
    latitude_e7, longitude_e7 = origin.to_global(north, east)
    return message("MISSION_ITEM_INT", seq=number, frame=Frame.GLOBAL_RELATIVE_ALT_INT,
                   command=COMMAND_OF[item.kind], current=int(current), autocontinue=1, param1=item.hold_s,
                   param2=item.acceptance_m, param4=nan if item.yaw_rad is None else degrees(item.yaw_rad),
                   x=latitude_e7, y=longitude_e7, z=home_ned_m[2] - down, mission_type=MISSION_TYPE_MISSION)


def _position(sent: Message, kind: ItemKind, before: Sequence[MissionItem], origin: Origin,
              home_ned_m: Vector) -> Vector | MissionResult:
    frame, whole, height_m = sent["frame"], sent.name == "MISSION_ITEM_INT", sent["z"]
    x, y = float(sent["x"]), float(sent["y"])
    nowhere = not (isfinite(x) and isfinite(y)) or (x == y == 0 and kind is not ItemKind.WAYPOINT)
    if nowhere and kind is ItemKind.WAYPOINT:
        return MissionResult.INVALID_PARAM5_X
    if not isfinite(height_m):
        return MissionResult.INVALID
    if frame == Frame.LOCAL_NED:
        north, east = (x * 1e-4, y * 1e-4) if whole else (x, y)
        return north, east, height_m
    if frame not in ABSOLUTE and frame not in RELATIVE:
        return MissionResult.UNSUPPORTED_FRAME
    if nowhere:
        north, east, _ = before[-1].position_ned_m if before else home_ned_m
    else:
        latitude_deg, longitude_deg = (x / E7, y / E7) if whole else (x, y)
        if abs(latitude_deg) > 90 or abs(longitude_deg) > 180:
            return MissionResult.INVALID_PARAM5_X
        north, east = origin.to_local(latitude_deg, longitude_deg)
    base = home_ned_m[2] if frame in RELATIVE else origin.altitude_m
    return north, east, base - height_m
