"""The plant as a guest sees it: its motion in MAVLink's frames, and its four motors as channels of the guest.

    speed of a motor = motor_min + c (motor_max - motor_min)    for 0 < c <= 1, the command of its channel; 0 otherwise

The plant is `quadrotor`: motors on the body's axes, in the order front, left, back, right. PX4 and ArduPilot number
those of a "plus" frame right, left, front, back, hence the default of `channels`. The speed is linear in the command;
neither autopilot knows the curve of a motor unless its parameters (THR_MDL_FAC, MOT_THST_EXPO) say it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Final

from firmware_sim.autopilot.airframe import HUMMINGBIRD
from firmware_sim.autopilot.frames import frd_of, ned_of, ned_quaternion
from firmware_sim.autopilot.vehicle import Quaternion, Vector
from firmware_sim.board import Board

MOTION: Final = (("x", "m"), ("y", "m"), ("z", "m"), ("v[1]", "m/s"), ("v[2]", "m/s"), ("v[3]", "m/s"), ("q[1]", "1"),
          ("q[2]", "1"), ("q[3]", "1"), ("q[4]", "1"), ("omega[1]", "rad/s"), ("omega[2]", "rad/s"),
          ("omega[3]", "rad/s"), ("force[1]", "m/s2"), ("force[2]", "m/s2"), ("force[3]", "m/s2"))
MOST_CHANNELS: Final = 16


@dataclass(frozen=True)
class MotorSettings:
    channels: tuple[int, int, int, int] = (3, 2, 4, 1)      # of the motors front, left, back, right; counted from 1
    motor_min_radps: float = HUMMINGBIRD.motor_min_radps
    motor_max_radps: float = HUMMINGBIRD.motor_max_radps

    def __post_init__(self) -> None:
        object.__setattr__(self, "channels", tuple(self.channels))
        if len(self.channels) != 4 or len(set(self.channels)) != 4 \
                or not all(1 <= channel <= MOST_CHANNELS for channel in self.channels):
            raise ValueError(f"channels={list(self.channels)}: expected four different channels, 1 to {MOST_CHANNELS}, "
                             "of the motors front, left, back, right")
        for name in ("motor_min_radps", "motor_max_radps"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ValueError(f"{name}={getattr(self, name)}: expected a finite number, 0 or more")
        if self.motor_min_radps >= self.motor_max_radps:
            raise ValueError(f"motor_min_radps={self.motor_min_radps}: expected less than motor_max_radps "
                             f"({self.motor_max_radps})")

    def speeds(self, commands: Sequence[float]) -> tuple[float, ...]:
        """Return the speeds [rad/s] of the motors; `commands` has one number from 0 to 1 for each channel.

        A command above 1 is taken as 1; one of 0 or less, or that is no number, stops the motor.
        """
        found = []
        for channel in self.channels:
            command = commands[channel - 1]
            found.append(self.motor_min_radps + min(command, 1.0) * (self.motor_max_radps - self.motor_min_radps)
                         if command > 0 else 0.0)           # NaN > 0 is False
        return tuple(found)


@dataclass(frozen=True, slots=True)
class Motion:
    """The true motion of the plant; the world is NED, the body FRD."""

    position_ned_m: Vector
    velocity_ned_mps: Vector
    quaternion_wxyz: Quaternion         # from body to world
    rates_radps: Vector                 # body
    force_mps2: Vector                  # specific force, body: (0, 0, -9.81) at rest


class Body:
    def __init__(self, board: Board, motors: MotorSettings) -> None:
        """Raises NoPlant or PlantError if the node's plant is not like the quadrotor."""
        self._motors = motors
        self._sensors = board.sensors([name for name, _ in MOTION], [unit for _, unit in MOTION])
        self._actuators = board.actuators([f"u[{i}]" for i in range(1, 5)], ["rad/s"] * 4)

    def read(self) -> Motion:
        x, y, z, vx, vy, vz, qw, qx, qy, qz, ox, oy, oz, fx, fy, fz = self._sensors.read()
        return Motion(ned_of(x, y, z), ned_of(vx, vy, vz), ned_quaternion(qw, qx, qy, qz), frd_of(ox, oy, oz),
                      frd_of(fx, fy, fz))

    def drive(self, commands: Sequence[float]) -> None:
        """Set the motors from now on, by one command from 0 to 1 for each channel."""
        self._actuators.write(self._motors.speeds(commands))
