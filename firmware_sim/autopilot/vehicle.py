"""What a flight controller offers to whoever speaks for it on a link: state, commands, targets, mission, parameters.

    front (MAVLink)  --commands, targets, link_heard-->  Vehicle  --state(), notices-->  front

Frames are those of MAVLink: the world is NED with the origin of the motion capture's frame, the body is FRD, and
`quaternion_wxyz` turns body vectors into world vectors. Yaw counts clockwise from north. All times are readings of the
board's local clock.

Invariants:
- a call acts at once or is refused with a reason; none waits, none raises for what came over a link;
- numbers that are not finite are refused, numbers beyond limits are clipped and named in the answer;
- what a command starts (a climb, a landing) is seen in `state()`, not in the command's result.
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
    HOLD = "hold"               # stays where it is
    OFFBOARD = "offboard"       # position, velocity or attitude targets, a fresh one every `OFFB_LOSS_MS`
    TAKEOFF = "takeoff"         # climbs, then HOLD
    LAND = "land"               # descends where it is, disarms on the ground
    MISSION = "mission"
    RETURN = "return"           # flies to where it was armed, then LAND


class Result(Enum):
    """The names are those of MAV_RESULT."""

    ACCEPTED = "accepted"
    TEMPORARILY_REJECTED = "temporarily rejected"   # valid, but not now: try again
    DENIED = "denied"                               # this request can never work: its numbers are wrong
    UNSUPPORTED = "unsupported"
    FAILED = "failed"


class Landed(Enum):
    """The names are those of MAV_LANDED_STATE."""

    ON_GROUND = "on ground"
    TAKING_OFF = "taking off"
    IN_AIR = "in air"
    LANDING = "landing"


class Severity(IntEnum):
    """Numbers of MAV_SEVERITY."""

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
    """What the flight controller believes, at `time_ns`."""

    time_ns: int
    position_ned_m: Vector
    velocity_ned_mps: Vector
    quaternion_wxyz: Quaternion
    rates_radps: Vector             # body, FRD
    armed: bool
    mode: Mode
    landed: Landed
    failsafe: str                   # "" in normal flight, else the failsafe that acts: "link lost: hold"
    waypoint_index: int             # mission item that is flown; -1: none, len(mission): all done
    position_valid: bool            # motion capture is fresh


@dataclass(frozen=True, slots=True)
class PositionTarget:
    """Position where given, else velocity where given, axis by axis; velocity beside a position is fed forward.

    An axis with neither holds its position. Yaw and yaw rate both None: the heading is held.
    """

    position_ned_m: PerAxis = NO_AXIS
    velocity_ned_mps: PerAxis = NO_AXIS
    yaw_rad: float | None = None
    yaw_rate_radps: float | None = None


@dataclass(frozen=True, slots=True)
class AttitudeTarget:
    """Attitude, `rates_radps` fed forward; or without a quaternion body rates alone. `thrust` from 0 to 1 (full)."""

    quaternion_wxyz: Quaternion | None
    rates_radps: Vector | None
    thrust: float


Target = PositionTarget | AttitudeTarget


@dataclass(frozen=True, slots=True)
class MissionItem:
    kind: ItemKind
    position_ned_m: Vector          # TAKEOFF: only the height counts; LAND: only where; RETURN: nothing
    hold_s: float = 0.0
    acceptance_m: float = 0.0       # reached when so near; 0: the parameter NAV_ACC_RAD
    yaw_rad: float | None = None    # None: as it is


@dataclass(frozen=True, slots=True)
class ParameterInfo:
    """A parameter as the ground may see it; names have at most 16 characters."""

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
        """KeyError for a name that is not there."""
        ...

    def set(self, name: str, value: float) -> str:
        """"" if it was set, else why not, beginning with the name."""
        ...


Notice = Callable[[Severity, str], None]


class Vehicle(Protocol):
    on_notice: Notice               # called with texts for people, of at most 50 characters: STATUSTEXT

    @property
    def parameters(self) -> Parameters: ...

    @property
    def mission(self) -> Sequence[MissionItem]: ...

    def state(self) -> VehicleState: ...

    def arm(self, force: bool = False) -> Result:
        """`force` passes over the checks that can be passed over; a reason of refusal goes to `on_notice`."""
        ...

    def disarm(self, force: bool = False) -> Result:
        """On the ground; with `force` also in the air: the motors stop."""
        ...

    def set_mode(self, mode: Mode) -> Result: ...

    def take_off(self, height_m: float) -> Result:
        """Climb to `height_m` above the ground where it was armed. Needs to be armed and on the ground."""
        ...

    def land(self) -> Result: ...

    def target(self, target: Target, now_ns: int) -> list[str]:
        """Take a target for OFFBOARD (any) or STABILIZE (attitude); say what was clipped or refused, for the report.

        A target may come before the mode: PX4's rule that OFFBOARD needs a stream first.
        """
        ...

    def load_mission(self, items: Sequence[MissionItem]) -> Result:
        """Replaces the mission; not while one is flown. No items: clears it."""
        ...

    def start_mission(self, first: int = 0) -> Result: ...

    def link_heard(self, now_ns: int) -> None:
        """A valid frame came over the link: feeds the link-loss failsafe."""
        ...
