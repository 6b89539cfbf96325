"""The modes of flight as two tables: the rules of each mode, and the mode that follows an event of the flight.

`refusals`, `failsafe` and `flight` read `MODES`; the flight controller reads `AFTER`. An event that is not in `AFTER`
changes no mode. Commands and failsafes change the mode from any other.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from typing import Final, NamedTuple

from firmware_sim.autopilot.vehicle import Mode


class Position(Enum):
    """The condition under which a mode needs motion capture."""

    ALWAYS = auto()
    UNLESS_ATTITUDES = auto()       # not while the targets are attitudes or rates
    NEVER = auto()


class Targets(Enum):
    """The stream of targets that must be fresh for a mode to begin."""

    ANY = auto()
    ATTITUDES_IN_AIR = auto()       # on the ground none is required


class Where(Enum):
    """The place at which the armed vehicle must be for a mode to begin."""

    ON_GROUND = auto()
    IN_AIR = auto()


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeRules:
    position: Position = Position.ALWAYS
    targets: Targets | None = None          # None: the mode follows no stream of targets
    begins: Where | None = None             # None: anywhere, armed or not
    arms: bool = True                       # arming is allowed in this mode
    blind: bool = False                     # begins and goes on without motion capture, by dead reckoning
    homeward: bool = False                  # the loss of the link does not end this mode
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
    """Events of the flight that neither a command nor a failsafe causes."""

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
