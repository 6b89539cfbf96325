"""Flies a quadrotor by waypoints in OFFBOARD to its autopilot, which speaks MAVLink over a serial line.

    take-off     as in section 3.5: set up streams, arm, climb, hand over               (`agents.pursuit.flight_plan`)
    waypoint     next place of the straightened way; a corner is passed when it is within `reach_m`
                 sent at once when it changes, and again every `resend_every` steps, since OFFBOARD needs a stream
    stop         the waypoint is where the ramp of the autopilot comes to rest from the present velocity
    place        what the vehicle reported last, carried on with the velocity that it reported; its start before that

Before OFFBOARD the mover sends no waypoint; afterwards the vehicle flies to the last one. Places are x east, y north;
MAVLink has north, east, down. Way to rest from v, at the ramp's acceleration a and with a delay r from a waypoint to
the vehicle's motion: v r + v^2 / (2 a), and `error_m` by which the vehicle leaves its ramp. That, and `over_share`, are
properties of the autopilot's loops, measured and not derived: 0.12 m and 0.35 while it flies to and fro at 2 m/s.

Not modelled: wind, a lost line (the autopilot holds, then lands; the sensor goes on to send).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import dist, hypot, isfinite, pi, remainder
from typing import Final

from agents.marco_polo_game.movers import Bounds, Platform, Stop
from agents.marco_polo_game.movers.plants import Remote, carrier_of, plant_problems, remote_problems, told_otherwise
from agents.marco_polo_game.movers.way import straightened
from agents.pursuit import Place
from agents.pursuit.flight_plan import FlightPlan
from agents.pursuit.law import Area
from firmware_sim.autopilot.vehicle import PositionTarget
from firmware_sim.board import Board
from firmware_sim.mavlink.companion import Companion
from firmware_sim.mavlink.counters import COMPANION_COUNTERS, BoardCounters
from firmware_sim.mavlink.link import MavlinkLink
from firmware_sim.scenario_view import ScenarioView

SYSTEM, COMPONENT = 245, 191            # MAV_COMP_ID_ONBOARD_COMPUTER
INPUTS: Final = ("u[1]", "u[2]", "u[3]", "u[4]")
POSITION: Final = "LOCAL_POSITION_NED"
MOST_AGE_S: Final = 0.5                 # for which a place is carried on; LINK_LOSS of the autopilot is longer


class QuadrotorMover:
    def __init__(self, board: Board, settings: QuadrotorSettings, area: Area, speed_mps: float) -> None:
        self._board, self._settings, self._area, self._speed_mps = board, settings, area, speed_mps
        self._vehicle = Companion(MavlinkLink(SYSTEM, COMPONENT), again_ns=settings.retry_ns)
        self._plan = FlightPlan(self._vehicle, settings.height_m, ((POSITION, settings.position_every_ns),),
                                board.event, board.warn)
        self._link = board.port(settings.link, self._hear, listen_only=True)
        self._yaw_rad = remainder(pi / 2 - settings.start[2], 2 * pi)
        self._heard_ns = 0                      # when the vehicle's place arrived
        self._way: list[Place] = [settings.start[:2]]
        self._due = 0                           # steps until the waypoint is sent again
        self._stop = Stop(settings.start[:2])
        board.count("waypoints sent", 0)
        self._counters = BoardCounters(board, COMPANION_COUNTERS)
        board.every(settings.step_ns, self._step)

    @property
    def place(self) -> Place:
        vehicle = self._vehicle
        if vehicle.position_ned_m is None or vehicle.velocity_ned_mps is None:
            return self._settings.start[:2]
        age_s = min((self._board.now_ns - self._heard_ns + self._settings.position_age_ns) * 1e-9, MOST_AGE_S)
        north, east, _ = (at + age_s * speed for at, speed in zip(vehicle.position_ned_m, vehicle.velocity_ned_mps,
                                                                  strict=True))
        return east, north

    @property
    def coasted_m(self) -> float:
        return self._stop.coasted_m(self.place)

    def go(self, places: Sequence[Place]) -> None:
        if places:
            self._stop.at = None
            self._way = straightened(self.place, places, self._settings.aside_m)
            self._due = 0
            self._lead()

    def stop(self) -> None:
        x, y = self._stop.at = self.place
        north, east, _ = self._vehicle.velocity_ned_mps or (0.0, 0.0, 0.0)
        told_mps = hypot(north, east)
        v = min(told_mps, self._speed_mps)      # that of the ramp; the vehicle may be faster for a while
        ahead_s = (v * self._settings.response_ns * 1e-9 + v ** 2 / (2 * self._settings.accel_mps2)) / (told_mps or 1.0)
        self._way = [self._area.nearest((x + east * ahead_s, y + north * ahead_s))]
        self._due = 0
        self._lead()

    def _hear(self, data: bytes) -> None:
        now_ns = self._board.now_ns
        if any(told.name == POSITION for told in self._vehicle.hear(data, now_ns)):
            self._heard_ns = now_ns
        while self._vehicle.texts:
            self._board.event("vehicle says", self._vehicle.texts.pop(0))

    def _step(self) -> None:
        now_ns = self._board.now_ns
        self._plan.step(now_ns)
        for frame in self._vehicle.step(now_ns):
            self._link.send(frame)
        while len(self._way) > 1 and dist(self.place, self._way[0]) <= self._settings.reach_m:
            self._way.pop(0)
            self._due = 0
        self._lead()
        self._counters.note(self._vehicle.link.counts)

    def _lead(self) -> None:
        """Send the waypoint, if it is due and the vehicle takes one."""
        if self._due > 0:
            self._due -= 1
        elif self._plan.leads:
            x, y = self._way[0]
            place = PositionTarget((y, x, -self._settings.height_m), yaw_rad=self._yaw_rad)
            self._link.send(self._vehicle.target(place, self._board.now_ns))
            self._due = self._settings.resend_every - 1
            self._board.count("waypoints sent")


@dataclass(frozen=True)
class QuadrotorSettings:
    """Times are on the local clock."""

    link: str                                   # name of the port on the line to the vehicle
    start: tuple[float, float, float]           # x [m], y [m], heading [rad], which is kept
    height_m: float = 1.5                       # of the flight; the take-off climbs to MIS_TAKEOFF_ALT
    accel_mps2: float = 1.5                     # of the autopilot's ramp: ACC_MAX
    reach_m: float = 0.5                        # of a corner, to pass it: a cell
    aside_m: float = 0.25                       # from the places that it is given, while it passes them
    step_ns: int = 50_000_000                   # between two looks at the flight and the way
    resend_every: int = 4                       # steps between repetitions of a waypoint
    position_every_ns: int = 50_000_000         # period of the vehicle's position messages
    position_age_ns: int = 0                    # from the vehicle's reading of its place until it is received
    response_ns: int = 200_000_000              # from a waypoint until the vehicle's ramp leads there
    error_m: float = 0.25                       # greatest distance of the vehicle from its ramp
    over_share: float = 0.5                     # of the speed, by which the reported place may change faster at most
    retry_ns: int = 500_000_000                 # from a command without an answer until it is repeated

    def __post_init__(self) -> None:
        for name in ("height_m", "accel_mps2", "reach_m"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name}={getattr(self, name)}: expected more than 0")
        for name in ("aside_m", "error_m", "over_share"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ValueError(f"{name}={getattr(self, name)}: expected 0 or more")
        if not all(map(isfinite, self.start)):
            raise ValueError(f"start={self.start}: expected finite numbers")
        for name, least in (("step_ns", 1), ("resend_every", 1), ("position_every_ns", 1), ("position_age_ns", 0),
                            ("response_ns", 0), ("retry_ns", 1)):
            if getattr(self, name) < least:
                raise ValueError(f"{name}={getattr(self, name)}: expected {least} or more")

    def mover(self, board: Board, area: Area, speed_mps: float) -> QuadrotorMover:
        return QuadrotorMover(board, self, area, speed_mps)

    def bounds(self, speed_mps: float) -> Bounds:
        rest_m = speed_mps * self.response_ns * 1e-9 + speed_mps ** 2 / (2 * self.accel_mps2)
        return Bounds((1 + self.over_share) * speed_mps, self.error_m, rest_m + self.error_m)

    def problems(self, scenario: ScenarioView, platform: Platform) -> Iterator[str]:
        name = platform.sensor
        yield from remote_problems(scenario, platform, Remote("flight", "flies", "link", self.link, "serial_line",
                                                              "autopilot", "vehicle"))
        if (carrier := carrier_of(scenario, platform, self.link)) is None:
            return
        plant = scenario.agents[carrier].plant
        if plant is None:
            yield (f"agents.{carrier}.plant: is missing; {name} flies it: "
                   "{ fmu = \"quadrotor\", preset = \"hummingbird\" }")
        else:
            yield from plant_problems(carrier, plant, INPUTS, "quadrotor")
            yield from told_otherwise(carrier, plant, dict(zip(("x", "y"), self.start, strict=False)),
                                      f"agents.{name}.parameters.flight.start")
