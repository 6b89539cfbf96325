"""PX4 as the guest of a node, in lockstep: our side of its simulation over MAVLink and TCP.

    meet      PX4 connects to `listen`
    boot      HIL_SENSOR every step of PX4's time, the plant stands still       until the first HIL_ACTUATOR_CONTROLS
    fly       every step:  sensors of the plant  --HIL_SENSOR, HIL_GPS-->  PX4  --HIL_ACTUATOR_CONTROLS-->  motors

PX4 takes its time from `time_usec` of HIL_SENSOR: that of its boot, then that time plus the node's local clock. So the
drift of the node's clock is that of PX4's, and booting takes no virtual time. The answer to a step is the first
HIL_ACTUATOR_CONTROLS whose `time_usec` is that of the step or later; the commands of an older one are used, too.

The node waits for an answer for `answer_within_s` of the wall clock. An armed PX4 that has not answered by then flies
on with its last commands, which is counted and an event; `gone_after_s` without any answer end the run. A disarmed one
need not answer each step: from its first silence on the node waits only for the duration of a step, until it answers
again.

Not modelled: an airspeed sensor, a lidar, RC input. Nothing here has met a real PX4: docs/guests.md.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from math import isfinite
from typing import ClassVar, Final

from simpy.events import Event

from firmware_sim.board import Board
from firmware_sim.guests.addresses import check_guests
from firmware_sim.guests.body import MOST_CHANNELS, Body, MotorSettings
from firmware_sim.guests.door import Caller, GuestFailure, loopback_address
from firmware_sim.guests.sensors import Sensors, SensorSettings
from firmware_sim.guests.telemetry import Telemetry, TelemetrySettings
from firmware_sim.mavlink.dialect import Message, layout_of, message, pack, unpack
from firmware_sim.mavlink.framing import FrameReader, build
from firmware_sim.scenario_view import Own, ScenarioView

ARMED: Final = 128                          # flag of HIL_ACTUATOR_CONTROLS.mode
SET_MESSAGE_INTERVAL: Final = 511
HIL_STATE_QUATERNION: Final = 115
HEARTBEAT_NS: Final = 1_000_000_000
GENERIC, NO_AUTOPILOT = 0, 8                # MAV_TYPE, MAV_AUTOPILOT of the simulator's own heartbeat
SHORTEST_WAIT_S: Final = 1e-3


@dataclass(frozen=True)
class Px4Settings:
    """Times that end in `_s` are of the wall clock, the others of the node's local clock."""

    listen: str = "127.0.0.1:4560"          # PX4 connects to 4560 + its instance
    step_ns: int = 4_000_000                # period of HIL_SENSOR
    gps_period_ns: int = 200_000_000
    connect_within_s: float = 25.0          # for the connection, and again for the boot
    answer_within_s: float = 1.0
    gone_after_s: float = 10.0
    motors: MotorSettings = field(default_factory=MotorSettings)
    sensors: SensorSettings = field(default_factory=SensorSettings)
    telemetry: TelemetrySettings = field(default_factory=TelemetrySettings)

    def __post_init__(self) -> None:
        loopback_address("listen", self.listen)
        for name in ("connect_within_s", "answer_within_s", "gone_after_s"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name}={getattr(self, name)}: expected more than 0 seconds")
        if self.step_ns < 1_000 or self.step_ns % 1_000:
            raise ValueError(f"step_ns={self.step_ns}: expected whole microseconds, the unit of PX4's time, 1 or more")
        if self.gps_period_ns < self.step_ns:
            raise ValueError(f"gps_period_ns={self.gps_period_ns}: expected at least step_ns ({self.step_ns})")


class Px4Guest:
    Settings: ClassVar = Px4Settings

    def __init__(self, board: Board, settings: Px4Settings) -> None:
        self._board, self._settings = board, settings
        self._name = f"agents.{board.name}"
        self._body = Body(board, settings.motors)
        self._sensors = Sensors(settings.sensors, board.rng)
        self._telemetry = Telemetry(board, settings.telemetry)
        self._caller = Caller(self._name, loopback_address("listen", settings.listen))
        board.at_end(self._caller.close)
        self._reader = FrameReader()
        self._sequence = 0
        self._boot_us = 0                       # PX4's time when the node's clock read 0
        self._due_ns = {"HIL_GPS": 0, "HEARTBEAT": 0}
        self._every_ns = {"HIL_GPS": settings.gps_period_ns, "HEARTBEAT": HEARTBEAT_NS}
        self._armed = False
        self._answers = False                   # it has answered the last step
        self._silent_s = 0.0                    # time waited in vain since the last answer, while armed
        for counter in ("steps", "steps without answer", "noise bytes from PX4"):
            board.count(counter, 0)
        board.record("armed", "1", lambda: float(self._armed))

    def run(self) -> Generator[Event, None, None]:
        board, step_ns = self._board, self._settings.step_ns
        self._caller.meet(self._settings.connect_within_s)
        self._boot()
        while True:
            self._step()
            yield from board.sleep_until(board.now_ns // step_ns * step_ns + step_ns)

    # --- the three phases

    def _boot(self) -> None:
        """Let PX4's time pass until it answers, while virtual time and the plant stand still."""
        step_us = self._settings.step_ns // 1_000
        until_s = time.monotonic() + self._settings.connect_within_s
        while True:
            self._boot_us += step_us
            self._tell(self._boot_us, self._boot_us * 1_000)
            if self._answered(self._boot_us, self._settings.step_ns * 1e-9):
                break
            if time.monotonic() > until_s:
                raise GuestFailure(f"{self._name}: the autopilot has sent no HIL_ACTUATOR_CONTROLS for "
                                   f"{self._settings.connect_within_s:g} s of sensors; is it PX4 built for simulation "
                                   "(make px4_sitl), with lockstep?")
        self._boot_us += step_us                # the time of HIL_SENSOR only grows
        self._answers = True
        self._due_ns = dict.fromkeys(self._due_ns, 0)
        self._telemetry.begin()
        self._board.event("guest booted", f"PX4 answered after {self._boot_us * 1e-6:g} s of its time")

    def _step(self) -> None:
        board = self._board
        now_ns = board.now_ns
        time_us = self._boot_us + now_ns // 1_000
        self._tell(time_us, now_ns)
        wait_s = (self._settings.answer_within_s if self._armed or self._answers else
                  max(SHORTEST_WAIT_S, self._settings.step_ns * 1e-9))
        board.count("steps")
        self._answers = self._answered(time_us, wait_s)
        if self._answers:
            self._silent_s = 0.0
        elif self._armed:
            self._missed(wait_s)
        else:
            board.count("steps without answer")
        self._telemetry.pass_on()

    def _missed(self, waited_s: float) -> None:
        self._board.count("steps without answer")
        if not self._silent_s:
            self._board.warn("guest late", f"PX4 has not answered a step for {waited_s:g} s; it flies on with its last "
                             "commands")
        self._silent_s += waited_s
        if self._silent_s >= self._settings.gone_after_s:
            raise GuestFailure(f"{self._name}: PX4 is armed and has not answered for {self._silent_s:g} s; is it "
                               "stopped in a debugger, or does its log name a stalled module?")

    # --- messages

    def _tell(self, time_us: int, local_ns: int) -> None:
        """Send the sensors' readings at PX4's time `time_us`, and what else is due at `local_ns`."""
        motion = self._body.read()
        found = [self._sensors.inertial(motion, time_us)]
        for name, due_ns in self._due_ns.items():
            if local_ns >= due_ns:
                self._due_ns[name] = local_ns - local_ns % self._every_ns[name] + self._every_ns[name]
                found.append(self._message(name, time_us))
        self._caller.send(b"".join(map(self._framed, found)), self._settings.gone_after_s)

    def _message(self, name: str, time_us: int) -> Message:
        if name == "HEARTBEAT":
            return message("HEARTBEAT", type=GENERIC, autopilot=NO_AUTOPILOT, mavlink_version=3)
        make = self._sensors.gps if name == "HIL_GPS" else self._sensors.truth
        return make(self._body.read(), time_us)

    def _framed(self, each: Message) -> bytes:
        self._sequence = (self._sequence + 1) % 256
        return build(layout_of(each.name), pack(each), self._sequence, 1, 200)      # as a simulator names itself

    def _answered(self, time_us: int, within_s: float) -> bool:
        """Take messages until the answer to the step at `time_us` has come; False if `within_s` pass before."""
        until_s = time.monotonic() + within_s
        while data := self._caller.receive(until_s):
            answered = False
            for frame in self._reader.read(data):
                found = unpack(frame.layout, frame.payload)
                if found.name == "HIL_ACTUATOR_CONTROLS":
                    self._drive(found)
                    answered |= found["time_usec"] >= time_us
                elif found.name == "COMMAND_LONG":
                    self._command(found)
            if noise := self._reader.counts.pop("noise bytes", 0):
                self._board.count("noise bytes from PX4", noise)
            if answered:
                return True
        return False

    def _drive(self, controls: Message) -> None:
        armed = bool(controls["mode"] & ARMED)
        if armed != self._armed:
            self._armed = armed
            self._board.event("guest armed" if armed else "guest disarmed")
        self._body.drive(controls["controls"] if armed else (0.0,) * MOST_CHANNELS)

    def _command(self, command: Message) -> None:
        """Follow SET_MESSAGE_INTERVAL for the ground truth, the only message that PX4 asks for."""
        interval_us = command["param2"]
        if command["command"] == SET_MESSAGE_INTERVAL and command["param1"] == HIL_STATE_QUATERNION \
                and isfinite(interval_us) and interval_us > 0:
            self._every_ns["HIL_STATE_QUATERNION"] = max(self._settings.step_ns, round(interval_us * 1e3))
            self._due_ns.setdefault("HIL_STATE_QUATERNION", 0)

    @staticmethod
    def check(scenario: ScenarioView, own: Own[Px4Settings]) -> Iterator[str]:
        """Yield the reasons why these guests could not take part."""
        yield from check_guests(own, "PX4", "tcp", "PX4's instance N uses 4560 + N")
