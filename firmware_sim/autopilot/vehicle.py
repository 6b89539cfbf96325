"""The interface of a flight controller to the front of a link: state, commands, targets, mission, parameters.

    front (MAVLink)  --commands, targets, link_heard-->  Vehicle  --state(), notices-->  front

Frames are those of MAVLink: the world is NED with the origin of the motion capture's frame, the body is FRD, and
`quaternion_wxyz` turns body vectors into world vectors. Yaw counts clockwise from north. All times are readings of the
board's local clock.

Invariants:
- a call acts at once or is refused with a reason; it never waits, and raises for no data received over a link;
- numbers that are not finite are refused, numbers beyond limits are clipped and named in the answer;
- `state()` shows the progress of what a command starts (a climb, a landing); the command's result does not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Final, Protocol

MOST_MISSION_ITEMS: Final = 200

Vector = tuple[float, float, float]
PerAxis = tuple[float | None, float | None, float | None]
Quaternion = tuple[float, float, float, float]
NO_AXIS: PerAxis = (None, None, None)


class Mode(Enum):
    STABILIZE = "stabilize"     # attitude targets, no motion capture needed
    HOLD = "hold"               # stays at its place
    OFFBOARD = "offboard"       # position, velocity or attitude targets, a fresh one every `OFFB_LOSS_MS`
    TAKEOFF = "takeoff"         # climbs, then HOLD
    LAND = "land"               # descends vertically, disarms on the ground
    MISSION = "mission"         # flies the items of the mission
    RETURN = "return"           # flies to the place where it was armed, then LAND


class Result(Enum):
    """The result of a command, named as in MAV_RESULT."""

    ACCEPTED = "accepted"
    TEMPORARILY_REJECTED = "temporarily rejected"   # valid, but not now: try again
    DENIED = "denied"                               # this request can never work: its numbers are wrong
    UNSUPPORTED = "unsupported"
    FAILED = "failed"


class Landed(Enum):
    """The phase of flight, named as in MAV_LANDED_STATE."""

    ON_GROUND = "on ground"
    TAKING_OFF = "taking off"
    IN_AIR = "in air"
    LANDING = "landing"


class Severity(IntEnum):
    """The severity of a notice, numbered as in MAV_SEVERITY."""

    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6


class ItemKind(Enum):
    TAKEOFF = "takeoff"
    WAYPOINT = "waypoint"
    LAND = "land"
    RETURN = "return"


@dataclass(frozen=True, slots=True)
class VehicleState:
    """The flight controller's estimate and state at `time_ns`."""

    time_ns: int
    position_ned_m: Vector
    velocity_ned_mps: Vector
    quaternion_wxyz: Quaternion
    rates_radps: Vector             # body, FRD
    armed: bool
    mode: Mode
    landed: Landed
    failsafe: str                   # text of the failsafe in force ("link lost: hold"); "": none
    waypoint_index: int             # index of the mission item being flown; -1: none, len(mission): all done
    position_valid: bool            # motion capture is not lost


@dataclass(frozen=True, slots=True)
class PositionTarget:
    """A target for each axis: a position, a velocity, or a position with its velocity as feedforward.

    An axis with neither holds its position. With neither yaw nor yaw rate the heading is held.
    """

    position_ned_m: PerAxis = NO_AXIS
    velocity_ned_mps: PerAxis = NO_AXIS
    yaw_rad: float | None = None
    yaw_rate_radps: float | None = None


@dataclass(frozen=True, slots=True)
class AttitudeTarget:
    """An attitude with `rates_radps` as feedforward, or without a quaternion body rates; `thrust` is 0 to 1 (full)."""

    quaternion_wxyz: Quaternion | None
    rates_radps: Vector | None
    thrust: float


Target = PositionTarget | AttitudeTarget


@dataclass(frozen=True, slots=True)
class MissionItem:
    kind: ItemKind
    position_ned_m: Vector          # TAKEOFF uses its height only, LAND north and east only, RETURN nothing
    hold_s: float = 0.0
    acceptance_m: float = 0.0       # distance at which the item is reached; 0: the parameter NAV_ACC_RAD
    yaw_rad: float | None = None    # None: the heading is held


@dataclass(frozen=True, slots=True)
class ParameterInfo:
    """The description of a parameter; its name has at most 16 characters."""

    default: float
    minimum: float
    maximum: float
    unit: str
    about: str


class Parameters(Protocol):
    """Parameters by name, in a fixed order: a name's index is its place in `infos`."""

    @property
    def infos(self) -> Mapping[str, ParameterInfo]: ...

    def get(self, name: str) -> float:
        """Return the value; KeyError for an unknown name."""

    def set(self, name: str, value: float) -> str:
        """Set the value; return "", or why it was refused, beginning with the name."""


Notice = Callable[[Severity, str], None]


class Vehicle(Protocol):
    on_notice: Notice               # called with texts for the operator, of at most 50 characters (STATUSTEXT)

    @property
    def parameters(self) -> Parameters: ...

    @property
    def mission(self) -> Sequence[MissionItem]: ...

    def state(self) -> VehicleState: ...

    def arm(self, force: bool = False) -> Result:
        """Arm; `force` skips some checks (`refusals.arming`). The reason of a refusal goes to `on_notice`."""

    def disarm(self, force: bool = False) -> Result:
        """Stop the motors, on the ground or, with `force`, also in the air."""

    def set_mode(self, mode: Mode) -> Result: ...

    def take_off(self, height_m: float) -> Result:
        """Climb to `height_m` above the ground where it was armed; refused unless armed and on the ground."""

    def land(self) -> Result: ...

    def target(self, target: Target, now_ns: int) -> list[str]:
        """Take a target for OFFBOARD (any) or STABILIZE (attitude); return a text for each number clipped or refused.

        Targets may arrive before the mode: as in PX4, OFFBOARD requires a stream of them.
        """

    def load_mission(self, items: Sequence[MissionItem]) -> Result:
        """Replace the mission, or clear it by no items; refused while one is flown."""

    def start_mission(self, first: int = 0) -> Result: ...

    def link_heard(self, now_ns: int) -> None:
        """Note that a valid frame arrived over the link, for the link-loss failsafe."""
