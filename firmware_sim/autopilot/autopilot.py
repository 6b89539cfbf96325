"""The board of a quadrotor: runs the flight controller on its local clock; motion capture in, motor speeds out.

    release  --execution_ns--> motor commands     release + period
    |  gyro, attitude, accelerometer              all times on the local clock

The program reads gyro, attitude and accelerometer from the plant at each release; positions arrive from motion capture
only, late. It sends no frames. A task that connects the vehicle to a link uses `controller`, a `Vehicle`.

Plant: `quadrotor`, inputs u[1..4]; its coordinate frames are converted to MAVLink's here.
Not modelled: noise and bias of the inertial sensors (the attitude is that of a perfect filter), a barometer, a battery.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from typing import Any, ClassVar, Final

from mypy_extensions import mypyc_attr
from simpy.events import Event

from firmware_sim.autopilot.autopilot_settings import AutopilotSettings
from firmware_sim.autopilot.exposure_clock import ExposureClock
from firmware_sim.autopilot.flight_controller import FlightController
from firmware_sim.autopilot.frames import frd_of, ned_of, ned_quaternion, roll_pitch_yaw
from firmware_sim.autopilot.mixer import OFF
from firmware_sim.autopilot.vehicle import Landed, Mode, Severity
from firmware_sim.board import Board
from firmware_sim.scenario_view import Own, ScenarioView
from firmware_sim.schedules.periodic import Periodic
from netem.media.sensing.sight import NothingSeen, unpack_sight
from netem.wire.instants import NEVER_NS
from netem.wire.level import Level

SENSORS: Final = (*(f"q[{i}]" for i in range(1, 5)), *(f"omega[{i}]" for i in range(1, 4)),
                  *(f"force[{i}]" for i in range(1, 4)))
SENSOR_UNITS: Final = (*("1",) * 4, *("rad/s",) * 3, *("m/s2",) * 3)
TRUTH: Final = (("x", "m"), ("y", "m"), ("z", "m"), ("v[1]", "m/s"), ("v[2]", "m/s"), ("v[3]", "m/s"), ("roll", "rad"),
                ("pitch", "rad"), ("heading", "rad"), ("thrust", "N"))
BELIEF: Final = (("est_north", "m"), ("est_east", "m"), ("est_down", "m"), ("ref_north", "m"), ("ref_east", "m"),
                 ("ref_down", "m"), ("ref_roll", "rad"), ("ref_pitch", "rad"), ("ref_yaw", "rad"), ("armed", "1"),
                 ("mode", "1"), ("landed", "1"))
MODES: Final = {mode: float(number) for number, mode in enumerate(Mode)}
LANDED: Final = {landed: float(number) for number, landed in enumerate(Landed)}
LEVELS: Final = {Severity.CRITICAL: Level.WARNING, Severity.ERROR: Level.WARNING, Severity.WARNING: Level.WARNING,
                 Severity.NOTICE: Level.INFO, Severity.INFO: Level.INFO}     # no fault of the run itself: no more
COUNTERS: Final = ("releases missed", "unreadable frames", "motion capture out of order", "motion capture taken",
                   "motion capture refused")
NO_PLANT: Final = 'an autopilot needs a plant, as plant = { fmu = "quadrotor", preset = "hummingbird" }'


@mypyc_attr(allow_interpreted_subclasses=True)
class Autopilot:
    Settings: ClassVar = AutopilotSettings
    has_execution_time: ClassVar = True

    def __init__(self, board: Board, settings: AutopilotSettings) -> None:
        self._settings, self._board = settings, board
        self._body = settings.body or board.name
        board.port(settings.port_of(board.ports), self._captured, listen_only=True)
        self.controller = FlightController(settings.airframe, settings.period_ns, settings.navigation_every,
                                           settings.parameters)
        self.listeners: list[Callable[[Severity, str], None]] = [self._note]     # each is called with every notice
        self.controller.on_notice = self._notice
        self._stamps = ExposureClock()
        self._motors = board.actuators([f"u[{i}]" for i in range(1, 5)], ["rad/s"] * 4)
        self._sensors = board.sensors(SENSORS, SENSOR_UNITS)
        self._truth = board.sensors([name for name, _ in TRUTH], [unit for _, unit in TRUTH])
        for counter in COUNTERS:
            board.count(counter, 0)
        board.record_all([*TRUTH, *BELIEF], self._sample)

    # --- the program

    def run(self) -> Generator[Event, Any, None]:
        board, settings = self._board, self._settings
        schedule, execution_ns, tick = Periodic(settings.period_ns, settings.offset_ns), settings.execution_ns, \
            self.controller.tick
        release_ns = schedule.next_after(board.now_ns - 1)
        written = OFF
        while True:
            # a hardware timer: the loop goes on when the local clock is set back
            yield board.until(release_ns, silent_until_ns=NEVER_NS)
            now_ns = board.now_ns
            w, x, y, z, ox, oy, oz, fx, fy, fz = self._sensors.read()
            motors = tick(now_ns, ned_quaternion(w, x, y, z), frd_of(ox, oy, oz), frd_of(fx, fy, fz))
            if motors != written:
                yield board.until(now_ns + board.execution_ns(execution_ns), silent_until_ns=NEVER_NS)
                self._motors.write(motors)
                written = motors
            before_ns, release_ns = release_ns, schedule.next_after(board.now_ns)
            if (missed := (release_ns - before_ns) // settings.period_ns - 1) > 0:
                board.count("releases missed", missed)

    # --- receive

    def _captured(self, data: bytes) -> None:
        board, now_ns = self._board, self._board.now_ns
        sight = unpack_sight(data)
        if sight is None:
            board.count("unreadable frames")
            return
        if isinstance(sight, NothingSeen) or sight.name != self._body:
            return
        delay_ns = round(self.controller.parameters.get("MOCAP_DELAY") * 1e9)
        exposed_ns = self._stamps.exposed_ns(sight.exposed_ns, now_ns, delay_ns)
        if exposed_ns is None:
            board.count("motion capture out of order")
        elif self.controller.captured(exposed_ns, ned_of(sight.x_m, sight.y_m, sight.z_m), now_ns):
            board.count("motion capture taken")
        else:
            board.count("motion capture refused")

    # --- notices and samples

    def _notice(self, severity: Severity, text: str) -> None:
        for listener in self.listeners:
            listener(severity, text)

    def _note(self, severity: Severity, text: str) -> None:
        self._board.event(f"autopilot {severity.name.lower()}", text, LEVELS[severity])

    def _sample(self) -> list[float]:
        state, loops = self.controller.state(), self.controller.loops
        north, east = loops.horizontal.position
        return [*self._truth.read(), *state.position_ned_m, north, east, loops.vertical.position[0],
                *roll_pitch_yaw(loops.target), state.armed, MODES[state.mode], LANDED[state.landed]]

    @staticmethod
    def check(scenario: ScenarioView, own: Own[AutopilotSettings]) -> Iterator[str]:
        """Yield the reasons why these autopilots could not start."""
        for name, agent in own.items():
            try:
                agent.settings.port_of(agent.media)
            except ValueError as error:
                yield f"agents.{name}.parameters: {error}"
            if not agent.has_plant:
                yield f"agents.{name}: {NO_PLANT}"
