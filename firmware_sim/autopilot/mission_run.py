"""The progress of a mission: the current item, its target, and whether it is reached.

    TAKEOFF    straight up to its height                 WAYPOINT    to its position, then stay for `hold_s`
    LAND       to above its position, then down          RETURN      left to the mode RETURN

An item is reached when the vehicle is within its radius. An index after the last item means that all are done.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import dist, isfinite

from firmware_sim.autopilot.vehicle import MOST_MISSION_ITEMS, ItemKind, MissionItem, Parameters, PositionTarget, Vector


def complaint(items: Sequence[MissionItem], parameters: Parameters) -> str:
    """Return why the items are no valid mission, "" if they are."""
    fence, height = parameters.get("FENCE_XY"), parameters.get("FENCE_ALT")
    if len(items) > MOST_MISSION_ITEMS:
        return f"{len(items)} items: at most {MOST_MISSION_ITEMS}"
    for index, item in enumerate(items):
        north, east, down = item.position_ned_m
        if not all(map(isfinite, (north, east, down, item.hold_s, item.acceptance_m, item.yaw_rad or 0.0))):
            return f"item {index}: not a finite number"
        if max(abs(north), abs(east)) > fence or not -height <= down <= 0:
            return f"item {index}: outside the fence"
        if item.hold_s < 0 or item.acceptance_m < 0:
            return f"item {index}: negative hold or radius"
    return ""


@dataclass
class MissionRun:
    items: Sequence[MissionItem] = ()
    index: int = 0
    _reached_ns: int | None = field(default=None, init=False)
    _above: bool = field(default=False, init=False)         # the position of a LAND item is reached
    _from: Vector = field(default=(0.0, 0.0, 0.0), init=False)

    @property
    def item(self) -> MissionItem | None:
        """The current item; None: all are done."""
        return self.items[self.index] if self.index < len(self.items) else None

    def start(self, index: int, position: Vector) -> None:
        self.index, self._from = index, position
        self._reached_ns, self._above = None, False

    def goal(self, land_speed: float) -> PositionTarget:
        """Return the target of the current item, which must not be a RETURN."""
        item = self.items[self.index]
        north, east, down = item.position_ned_m
        if item.kind is ItemKind.TAKEOFF:
            return PositionTarget((self._from[0], self._from[1], down), yaw_rad=item.yaw_rad)
        if item.kind is ItemKind.LAND:
            if self._above:
                return PositionTarget((north, east, None), (None, None, land_speed), item.yaw_rad)
            return PositionTarget((north, east, None), yaw_rad=item.yaw_rad)
        return PositionTarget((north, east, down), yaw_rad=item.yaw_rad)

    def advance(self, now_ns: int, position: Vector, radius_m: float) -> bool:
        """If the item is done, go to the next one and return True; a LAND ends by a call of `landed`."""
        item = self.items[self.index]
        goal = self.goal(0.0).position_ned_m
        pairs = [(p, a) for p, a in zip(position, goal, strict=True) if a is not None]
        way = dist(*zip(*pairs, strict=True))
        if self._reached_ns is None:
            if way > (item.acceptance_m or radius_m):
                return False
            self._reached_ns = now_ns
        if item.kind is ItemKind.LAND:
            self._above = True
            return False
        if now_ns - self._reached_ns < item.hold_s * 1e9:
            return False
        self.start(self.index + 1, position)
        return True

    def landed(self, position: Vector) -> None:
        """End a LAND item: the vehicle stands."""
        self.start(self.index + 1, position)
