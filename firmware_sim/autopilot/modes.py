"""The modes of flight as two tables: what each mode needs, and which mode follows when something happens in it.

`MODES` is read by what refuses a mode (`refusals`), by what ends one in silence (`failsafe`) and by what flies it
(`flight`); `AFTER` by the flight controller alone. What is not in `AFTER` changes no mode. Commands and failsafes
change the mode from any other.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from typing import Final, NamedTuple

from firmware_sim.autopilot.vehicle import Mode


class Position(Enum):
    """When a mode flies by motion capture."""

    ALWAYS = auto()
    UNLESS_ATTITUDES = auto()       # not while the targets are attitudes or rates
    NEVER = auto()


class Targets(Enum):
    """Which stream of targets must be fresh for a mode to begin."""

    ANY = auto()
    ATTITUDES_IN_AIR = auto()       # none on the ground


class Where(Enum):
    """Where the vehicle must be, armed, for a mode to begin."""

    ON_GROUND = auto()
    IN_AIR = auto()


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeRules:
    position: Position = Position.ALWAYS
    targets: Targets | None = None          # None: it follows no stream of targets
    begins: Where | None = None             # None: anywhere, armed or not
    arms: bool = True                       # the vehicle may be armed in it
    blind: bool = False                     # begins and goes on without motion capture, by dead reckoning
    homeward: bool = False                  # a silent link does not end it
    disarmed: Mode = Mode.HOLD              # the mode after the motors stop


MODES: Final = {
    Mode.STABILIZE: ModeRules(position=Position.NEVER, targets=Targets.ATTITUDES_IN_AIR, disarmed=Mode.STABILIZE),
    Mode.HOLD: ModeRules(),
    Mode.OFFBOARD: ModeRules(position=Position.UNLESS_ATTITUDES, targets=Targets.ANY),
    Mode.TAKEOFF: ModeRules(begins=Where.ON_GROUND, arms=False),
    Mode.LAND: ModeRules(begins=Where.IN_AIR, arms=False, blind=True, homeward=True),
    Mode.MISSION: ModeRules(),
    Mode.RETURN: ModeRules(begins=Where.IN_AIR, arms=False, homeward=True),
}


def needs_position(mode: Mode, attitude_told: bool) -> bool:
    position = MODES[mode].position
    return position is Position.ALWAYS or (position is Position.UNLESS_ATTITUDES and not attitude_told)


class Event(Enum):
    """What happens in flight by itself."""

    ARRIVED = auto()            # at the goal of TAKEOFF or RETURN
    ITEMS_DONE = auto()         # the last mission item is reached
    ITEM_RETURNS = auto()       # the mission item to fly now is a RETURN
    STANDS = auto()             # on the ground
    LAST_ITEM_STANDS = auto()   # on the ground by a LAND item that is the last one
    ITEM_STANDS = auto()        # on the ground by a LAND item with others after it


class Transition(NamedTuple):
    to: Mode | None             # None: disarm, then the mode that `ModeRules.disarmed` names
    notice: str


AFTER: Final = {
    (Mode.TAKEOFF, Event.ARRIVED): Transition(Mode.HOLD, "take-off done"),
    (Mode.RETURN, Event.ARRIVED): Transition(Mode.LAND, "home: landing"),
    (Mode.MISSION, Event.ITEMS_DONE): Transition(Mode.HOLD, "mission done"),
    (Mode.MISSION, Event.ITEM_RETURNS): Transition(Mode.RETURN, "mission: returning home"),
    (Mode.MISSION, Event.LAST_ITEM_STANDS): Transition(None, "landed: mission done"),
    (Mode.MISSION, Event.ITEM_STANDS): Transition(None, "landed: mission rests"),
    (Mode.LAND, Event.STANDS): Transition(None, "landed"),
}
