"""The companion's side of the drive's CAN messages: it sends setpoints, and reads wheel angles and confirmations.

    left, right = (v -+ omega b / 2) / r        wheel speeds for a command, r wheel radius, b track

A setpoint is confirmed when the running drive sends a status with its counter: then the wheels follow it.
"""

from __future__ import annotations

from math import isfinite, pi
from typing import NamedTuple

from agents.tracking.controller import Command
from firmware_sim.drive_controller.drive_messages import (
    DriveMessages,
    DriveState,
    FrameRefused,
    Mode,
    Odometry,
    Setpoint,
    WheelSpeeds,
)
from netem.media.can.frame import MalformedFrame, unpack
from netem.node.node import Port

COUNTERS = 256
COUNTS = 1 << 32


class Heard(NamedTuple):
    """The content of a frame of the drive; None: the frame does not have it."""

    angles_rad: tuple[float, float] | None = None       # left and right wheel, since the start
    confirmed: int | None = None                        # counter of the setpoint in force


class DriveLink:
    def __init__(self, port: Port, wheel_radius_m: float, track_m: float, counts_per_turn: int) -> None:
        for name, value in (("wheel_radius_m", wheel_radius_m), ("track_m", track_m)):
            if not (isfinite(value) and value > 0):
                raise ValueError(f"{name}={value}: expected more than 0")
        self._port = port
        self._radius_m, self._half_track_m = wheel_radius_m, track_m / 2
        self._rad_per_count = 2 * pi / counts_per_turn
        self._messages = DriveMessages()
        self._low, self._high = self._messages.range_of(Setpoint, "left_radps")
        self._counter = 0
        self._raw: tuple[int, int] | None = None
        self._counts = 0, 0

    def send(self, command: Command) -> int:
        """Send a setpoint, clipped to the message's range; return the counter that confirms it."""
        self._counter = (self._counter + 1) % COUNTERS
        turn = command.omega_rad_s * self._half_track_m
        left, right = ((command.v_mps + side) / self._radius_m for side in (-turn, turn))
        self._port.send(self._messages.pack(Setpoint(self._within(left), self._within(right), Mode.RUN, self._counter)))
        return self._counter

    def read(self, data: bytes) -> Heard | None:
        """Return the content of a frame: an empty `Heard` for a frame of another device, None for an unreadable one."""
        try:
            message = self._messages.unpack(unpack(data))
        except (MalformedFrame, FrameRefused):
            return None
        if isinstance(message, WheelSpeeds):
            return Heard(confirmed=message.counter if message.state == DriveState.RUNNING else None)
        return Heard(self._angles(message)) if isinstance(message, Odometry) else Heard()

    def _angles(self, odometry: Odometry) -> tuple[float, float]:
        """Return the wheels' angles; counts are modulo 2^32, of which a wheel turns less than half between messages."""
        before = self._raw or odometry
        left, right = (total + (now - then + COUNTS // 2) % COUNTS - COUNTS // 2
                       for total, now, then in zip(self._counts, odometry, before, strict=True))
        self._raw, self._counts = (odometry.left_count, odometry.right_count), (left, right)
        return left * self._rad_per_count, right * self._rad_per_count

    def _within(self, speed_radps: float) -> float:
        return min(max(speed_radps, self._low), self._high)
