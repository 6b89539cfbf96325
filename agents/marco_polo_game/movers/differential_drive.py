"""Drives a platform with two driven sides, such as a Pioneer P3-AT, by setpoints to its drive controller over CAN.

    odometry    wheel angles over CAN, reckoned to a pose                       (`agents.tracking.dead_reckoning`)
    each period, and when told to go or stop, a setpoint over CAN               (`agents.tracking.drive_link`):
      goal      next place of the straightened way; a corner is passed when it is within `reach_m`
      speed     what lets the platform take the next corner and stop at the last place, and no more than the game's
      wall      and no more than lets it brake before the boundary of the area, straight on
      steering  v = speed cos b,  omega = braking(|b'|, alpha), b' bearing from the nearer end, which may be its rear
      wheels    |v| + |omega| track / 2 <= the game's speed,  |dv/dt| + |domega/dt| track / 2 <= `wheel_mps2`

Linear and turning acceleration share what the wheels can do. To brake comes first, then to turn, then to speed up. So
braking with `accel_mps2` can be planned whatever the platform turns, and alpha = (wheel - accel) / (track / 2) is what
is left to end a turn meanwhile. A drive that is asked for more would turn and brake less than planned.

Wheels follow setpoints with a delay r (`response_ns`: the drive's period, its wheels' time constant, a period of this
mover). The way to rest from v is at most v r + v^2 / (2 wheel): so far it coasts after `stop`, and so far it leaves the
area at most, since beyond the boundary it brakes while its heading leads away.

Source: `agents.pursuit.steering`, which has a gain in place of the limits of acceleration.
Not modelled: slip, which the encoders do not measure, so that the platform knows its place.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import atan2, copysign, cos, dist, isfinite, pi, remainder, sqrt
from typing import Final

from agents.marco_polo_game.movers import Bounds, Platform, Stop
from agents.marco_polo_game.movers.plants import Remote, carrier_of, plant_problems, remote_problems, told_otherwise
from agents.marco_polo_game.movers.way import braking, corner_mps, room_m, straightened
from agents.pursuit import Place
from agents.pursuit.law import Area
from agents.tracking.check import ROBOT, wheel_problems
from agents.tracking.controller import Command, Pose
from agents.tracking.dead_reckoning import DeadReckoning
from agents.tracking.drive_link import DriveLink
from firmware_sim.board import Board
from firmware_sim.scenario_view import ScenarioView

STILL_MPS: Final = 0.02          # a platform that need not be faster is there
TURN_PER_S: Final = 2.0          # turn rate per bearing, for small ones
INPUTS: Final = ("u_left", "u_right", "angle_left", "angle_right")


class DifferentialDriveMover:
    def __init__(self, board: Board, settings: DifferentialDriveSettings, area: Area, speed_mps: float) -> None:
        self._board, self._settings, self._area = board, settings, area
        robot = board.team["robot"]
        self._half_m = robot["track_m"] / 2
        bus = board.port(settings.can, self._hear, listen_only=True)
        self._drive = DriveLink(bus, robot["wheel_radius_m"], robot["track_m"], robot["counts_per_turn"])
        self._reckoning = DeadReckoning(robot["wheel_radius_m"], robot["track_m"], Pose(*settings.start))
        self._speed_mps = speed_mps
        self._way: list[Place] = []
        self._corners_mps: list[float] = []
        self._command, self._sent_ns = Command(0.0, 0.0), 0         # of the newest setpoint
        self._stop = Stop(self.place)
        board.count("unreadable CAN frames", 0)
        board.every(settings.period_ns, self._tick)

    @property
    def place(self) -> Place:
        pose = self._pose()
        return pose.x_m, pose.y_m

    @property
    def coasted_m(self) -> float:
        return self._stop.coasted_m(self.place)

    def go(self, places: Sequence[Place]) -> None:
        own, settings = self.place, self._settings
        self._stop.at = None
        self._way = straightened(own, places, settings.aside_m)
        self._corners_mps = corner_mps(own, self._way, settings.reach_m, settings.omega_max_radps, settings.accel_mps2,
                                       settings.gain_per_s)
        self._control()

    def stop(self) -> None:
        self._way = []
        self._stop.at = self.place
        self._control()

    def _tick(self) -> None:
        """Send a setpoint; a platform that stands needs one only before its drive takes the last one for stale."""
        if self._way or any(self._command) or self._board.now_ns - self._sent_ns >= self._settings.alive_ns:
            self._control()

    def _control(self) -> None:
        now_ns = self._board.now_ns
        elapsed_s = min(now_ns - self._sent_ns, self._settings.period_ns) * 1e-9
        self._command, self._sent_ns = self._within_reach(self._wanted(self._pose()), elapsed_s), now_ns
        self._drive.send(self._command)

    def _wanted(self, pose: Pose) -> Command:
        """Return the velocity that leads along the way, whatever the present one is."""
        own, settings = (pose.x_m, pose.y_m), self._settings
        while len(self._way) > 1 and dist(own, self._way[0]) <= settings.reach_m:
            del self._way[0], self._corners_mps[0]
        if not self._way:
            return Command(0.0, 0.0)
        (x, y), away_m = self._way[0], dist(own, self._way[0])
        if len(self._way) > 1:
            speed = sqrt(self._corners_mps[0] ** 2 + 2 * settings.accel_mps2 * (away_m - settings.reach_m))
        else:
            speed = braking(away_m, settings.accel_mps2, settings.gain_per_s)
        if speed < STILL_MPS:
            return Command(0.0, 0.0)
        bearing = remainder(atan2(y - own[1], x - own[0]) - pose.theta_rad, 2 * pi)
        turn = remainder(bearing, pi)
        omega = min(settings.omega_max_radps, self._speed_mps / self._half_m, braking(
            abs(turn), settings.alpha_radps2(self._half_m), TURN_PER_S))
        v = min(speed, self._speed_mps) * cos(bearing)
        ahead_rad = pose.theta_rad if v >= 0 else pose.theta_rad + pi
        most = min(self._speed_mps - omega * self._half_m,
                   braking(room_m(own, ahead_rad, self._area), settings.accel_mps2, settings.gain_per_s))
        return Command(max(-most, min(most, v)), copysign(omega, turn))

    def _within_reach(self, wanted: Command, elapsed_s: float) -> Command:
        """Return what of a wanted velocity the wheels can reach from the last setpoint in `elapsed_s`."""
        v, omega = self._command
        budget = self._settings.wheel_mps2 * elapsed_s
        slower = max(-abs(v), min(abs(v), wanted.v_mps)) if wanted.v_mps * v > 0 else 0.0
        braked = v + _within(slower - v, budget)
        budget -= abs(braked - v)
        turned = omega + _within(wanted.omega_rad_s - omega, budget / self._half_m)
        budget -= abs(turned - omega) * self._half_m
        return Command(braked + _within(wanted.v_mps - braked, budget), turned)

    def _pose(self) -> Pose:
        return self._reckoning.pose_at(self._board.now_ns)

    def _hear(self, data: bytes) -> None:
        heard = self._drive.read(data)
        if heard is None:
            self._board.count("unreadable CAN frames")
        elif heard.angles_rad is not None:
            self._reckoning.read(self._board.now_ns - self._settings.odometry_age_ns, *heard.angles_rad)


def _within(change: float, most: float) -> float:
    return max(-most, min(most, change))


@dataclass(frozen=True)
class DifferentialDriveSettings:
    """Times are on the local clock."""

    can: str                                    # name of the port to the drive
    start: tuple[float, float, float]           # x [m], y [m], heading [rad]
    wheel_mps2: float                           # greatest acceleration of a wheel's rim
    accel_mps2: float                           # with which braking is planned, less than that
    omega_max_radps: float = 1.0
    gain_per_s: float = 1.0                     # speed per distance near the goal; less than 1 / (e response)
    reach_m: float = 0.25                       # of a corner, to pass it: half a cell
    aside_m: float = 0.1                        # from the places that it is given, while it passes them
    period_ns: int = 50_000_000                 # between two setpoints
    alive_ns: int = 200_000_000                 # the same, while it stands; less than `stale_after_ns` of the drive
    response_ns: int = 300_000_000              # from a setpoint, or its change, until the wheels follow it
    odometry_age_ns: int = 0                    # from the reading of the wheels until the frame is received

    def __post_init__(self) -> None:
        for name in ("wheel_mps2", "accel_mps2", "omega_max_radps", "gain_per_s", "reach_m"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name}={getattr(self, name)}: expected more than 0")
        if not self.accel_mps2 < self.wheel_mps2:
            raise ValueError(f"accel_mps2={self.accel_mps2}: leaves wheels with wheel_mps2={self.wheel_mps2} nothing "
                             f"to turn with while the platform brakes; take less, as {self.wheel_mps2 * 2 / 3:.3g}")
        if not (isfinite(self.aside_m) and self.aside_m >= 0):
            raise ValueError(f"aside_m={self.aside_m}: expected 0 or more")
        if not all(map(isfinite, self.start)):
            raise ValueError(f"start={self.start}: expected finite numbers")
        for name in ("alive_ns", "response_ns", "odometry_age_ns"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name}={getattr(self, name)}: expected 0 or more")

    def alpha_radps2(self, half_track_m: float) -> float:
        """Return the angular acceleration that is left while the platform brakes as planned."""
        return (self.wheel_mps2 - self.accel_mps2) / half_track_m

    def mover(self, board: Board, area: Area, speed_mps: float) -> DifferentialDriveMover:
        return DifferentialDriveMover(board, self, area, speed_mps)

    def bounds(self, speed_mps: float) -> Bounds:
        """Return the bounds of the place that the mover reckons.

        Between readings it goes on with the mean speed of the last interval, which is off by at most a times the time
        from the middle of that interval; two periods allow for readings as rare as setpoints."""
        rest_m = speed_mps * self.response_ns * 1e-9 + speed_mps ** 2 / (2 * self.wheel_mps2)
        return Bounds(speed_mps + 2 * self.wheel_mps2 * self.period_ns * 1e-9, rest_m, rest_m)

    def problems(self, scenario: ScenarioView, platform: Platform) -> Iterator[str]:
        name = platform.sensor
        yield from remote_problems(scenario, platform, Remote("drive", "drives", "can", self.can, "can",
                                                              "drive controller", "platform"))
        if self.can in platform.agent.media:
            yield from wheel_problems(scenario, name)
        if (carrier := carrier_of(scenario, platform, self.can)) is None:
            return
        plant = scenario.agents[carrier].plant
        if plant is None:
            yield f"agents.{carrier}.plant: is missing; {name} drives it: {{ fmu = \"unicycle\", preset = \"p3at\" }}"
        else:
            yield from plant_problems(carrier, plant, INPUTS, "unicycle")
            yield from self._plant_problems(scenario, platform, carrier)

    def _plant_problems(self, scenario: ScenarioView, platform: Platform, carrier: str) -> Iterator[str]:
        plant = scenario.agents[carrier].plant
        assert plant is not None
        where = f"agents.{platform.sensor}.parameters.drive"
        yield from told_otherwise(carrier, plant, dict(zip(("x", "y", "theta"), self.start, strict=True)),
                                  f"{where}.start")
        robot = scenario.team.get("robot", {})
        yield from told_otherwise(carrier, plant, {key: robot[key] for key in ROBOT[:2] if key in robot}, "team.robot")
        for limit, needed, key in (("speed_max_mps", platform.speed_mps, "team.game.ugv_mps"),
                                   ("accel_max_mps2", self.wheel_mps2, f"{where}.wheel_mps2")):
            if 0 < plant.parameters.get(limit, 0.0) < needed:
                yield (f"{key}={needed:g}: the wheels of agents.{carrier}.plant reach {limit}="
                       f"{plant.parameters[limit]:g}; take that or less, or faster wheels")
