"""Motor controller of a differential drive: wheel setpoints in over CAN, odometry out, a speed loop in between.

    release  --execution--> outputs, odometry      release + period
    |  encoders, setpoint   |  wheel commands      |
    all times on the local clock; a setpoint that arrives after a release acts from the next one on

An invalid setpoint frame is counted, recorded as an event and ignored. If no setpoint arrives for `stale_after_ns`, the
drive ramps down; that and its recovery are events. The program sends only at publications of odometry, also a change of
its state, so its promise is firm.

Plant: inputs u_left, u_right; outputs angle_left, angle_right; all outputs of `unicycle` are recorded.
Not modelled: motor current, faults of encoders, a watchdog in hardware, setpoints by remote frame.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from typing import Any, ClassVar, Final

from mypy_extensions import mypyc_attr
from simpy.events import Event

from firmware_sim.board import Board
from firmware_sim.drive_controller.drive_messages import (
    NO_AGE_MS,
    DriveMessage,
    DriveMessages,
    DriveState,
    FrameRefused,
    Odometry,
    Setpoint,
    Status,
    WheelSpeeds,
    identifiers_in,
)
from firmware_sim.drive_controller.drive_settings import DriveSettings
from firmware_sim.drive_controller.setpoint_ramp import SetpointRamp
from firmware_sim.drive_controller.setpoint_watch import SetpointWatch
from firmware_sim.drive_controller.wheel_encoder import WheelEncoder
from firmware_sim.scenario_view import Own, ScenarioView
from firmware_sim.schedules.periodic import Periodic
from netem.media.can.frame import MalformedFrame, unpack

TRUTH: Final = (("x", "m"), ("y", "m"), ("theta", "rad"), ("v", "m/s"), ("omega", "rad/s"), ("wheel_left", "rad/s"),
                ("wheel_right", "rad/s"))
COUNTERS: Final = ("releases missed", "unreadable frames", "setpoints refused", "setpoints taken")
NO_PLANT: Final = 'a drive controller needs a plant, as plant = { fmu = "unicycle" }'


@mypyc_attr(allow_interpreted_subclasses=True)
class DriveController:
    Settings: ClassVar = DriveSettings
    has_execution_time: ClassVar = True

    def __init__(self, board: Board, settings: DriveSettings) -> None:
        self._settings, self._board = settings, board
        self._messages = DriveMessages(settings.dbc, settings.unit)
        self._port = board.port(settings.port_of(board.ports), self._hear, listen_only=True)
        self._schedule = Periodic(settings.period_ns, settings.offset_ns)
        self._watch = SetpointWatch(settings.stale_after_ns)
        self._ramp = SetpointRamp(settings.stop_ramp_radps2, settings.ramp_radps2)
        self._loops = settings.speed_loop(), settings.speed_loop()
        self._encoders = WheelEncoder(settings.counts_per_turn), WheelEncoder(settings.counts_per_turn)
        self._sampled_ns: int | None = None         # local time of the last reading of the encoders
        self._commands = 0.0, 0.0
        self._counter = 0                           # counter of the setpoint that the loop used last
        self._refused = 0
        self._publications = 0
        self._speed_range = self._messages.range_of(WheelSpeeds, "left_radps")
        self._inputs = board.actuators(["u_left", "u_right"], ["rad/s", "rad/s"])
        self._angles = board.sensors(["angle_left", "angle_right"], ["rad", "rad"])
        self._truth = board.sensors([name for name, _ in TRUTH], [unit for _, unit in TRUTH])
        for counter in COUNTERS:
            board.count(counter, 0)
        board.record_all([*TRUTH, ("setpoint_left", "rad/s"), ("setpoint_right", "rad/s"), ("drive_state", "1")],
                           self._sample)

    # --- the program

    def run(self) -> Generator[Event, Any, None]:
        board, settings = self._board, self._settings
        release_ns = self._schedule.next_after(board.now_ns - 1)
        while True:
            publication_ns = settings.publication_after(release_ns)
            speaks_ns = publication_ns + settings.execution_ns
            yield from board.sleep_until(release_ns, silent_until_ns=speaks_ns)
            self._control()
            done_ns = release_ns + board.execution_ns(settings.execution_ns)
            yield from board.sleep_until(done_ns, silent_until_ns=speaks_ns)
            self._inputs.write(self._commands)
            if publication_ns == release_ns:
                self._publish()
            before_ns, release_ns = release_ns, self._schedule.next_after(board.now_ns)
            if missed := (release_ns - before_ns) // settings.period_ns - 1:
                board.count("releases missed", missed)

    def _control(self) -> None:
        """Do the work of a release: read the encoders, update the state, compute the commands."""
        board, watch, ramp = self._board, self._watch, self._ramp
        now_ns = board.now_ns
        elapsed_ns = self._read_encoders(now_ns)
        if (event := watch.look(now_ns)) is not None:
            board.event(*event)
        if watch.setpoint is not None:
            self._counter = watch.setpoint.counter
        ramp.follow(watch.state, watch.setpoint, elapsed_ns)
        left, right = self._encoders
        if watch.state is not DriveState.RUNNING and ramp.at_rest:      # motors off: the loop must not creep
            for loop in self._loops:
                loop.reset()
            self._commands = 0.0, 0.0
            return
        self._commands = (self._loops[0].command(ramp.left_radps, left.speed_radps, elapsed_ns),
                          self._loops[1].command(ramp.right_radps, right.speed_radps, elapsed_ns))

    def _read_encoders(self, now_ns: int) -> int:
        """Read the encoders; return the time since the last reading, 0 for the first or if the clock was set back."""
        angles = self._angles.read()
        elapsed_ns = 0 if self._sampled_ns is None else max(0, now_ns - self._sampled_ns)
        for encoder, angle in zip(self._encoders, angles, strict=True):
            if elapsed_ns:
                encoder.read(angle, elapsed_ns)
            else:
                encoder.restart(angle)
        self._sampled_ns = now_ns
        return elapsed_ns

    def _publish(self) -> None:
        left, right = self._encoders
        low, high = self._speed_range
        state, counter = self._watch.state, self._counter
        self._send(WheelSpeeds(max(low, min(high, left.speed_radps)), max(low, min(high, right.speed_radps)), state,
                               counter))
        self._send(Odometry(left.count, right.count))
        if self._publications % self._settings.status_every == 0:
            age_ns = self._watch.age_ns(self._board.now_ns)
            age_ms = NO_AGE_MS if age_ns is None else min(age_ns // 1_000_000, NO_AGE_MS - 1)
            self._send(Status(state, counter, self._refused % 65536, age_ms))
        self._publications += 1

    def _send(self, message: DriveMessage) -> None:
        self._port.send(self._messages.pack(message))

    # --- receive

    def _hear(self, data: bytes) -> None:
        board = self._board
        try:
            frame = unpack(data)
        except MalformedFrame:
            board.count("unreadable frames")
            return
        if self._messages.kind_of(frame) is not Setpoint:
            return
        try:
            setpoint = self._messages.unpack(frame)
        except FrameRefused as refusal:
            self._refused += 1
            board.count("setpoints refused")
            board.warn("setpoint refused", str(refusal))
            return
        assert isinstance(setpoint, Setpoint)
        board.count("setpoints taken")
        self._watch.heard(setpoint, self._board.now_ns)

    # --- samples and check

    def _sample(self) -> list[float]:
        return [*self._truth.read(), self._ramp.left_radps, self._ramp.right_radps, self._watch.state]

    @staticmethod
    def check(scenario: ScenarioView, own: Own[DriveSettings]) -> Iterator[str]:
        """Yield the reasons why these drives could not start, and drives on one bus with the same identifiers."""
        taken: dict[tuple[str, tuple[int, bool]], str] = {}
        for name, agent in own.items():
            settings = agent.settings
            try:
                medium = settings.port_of(agent.media)
                identifiers = identifiers_in(settings.dbc, settings.unit)
            except ValueError as error:
                yield f"agents.{name}.parameters: {error}"
                continue
            if not agent.has_plant:
                yield f"agents.{name}: {NO_PLANT}"
            for key in identifiers:
                other = taken.setdefault((medium, key), name)
                if other != name:
                    yield (f"agents.{name}.parameters: unit={settings.unit}: {other} has the identifier {key[0]:#x} on "
                           f"{medium} too, and their frames would collide; give each drive its own unit")
                    break
