"""The two messages between ArduPilot's SITL and a physics program over JSON: servo outputs in, state out.

    servo outputs, little endian:  magic (2), frame_rate (2), frame_count (4), pwm (2 each)     18458: 16 channels
                                                                                                29569: 32 channels
    state:  newline, JSON object, newline       order and spacing as ArduPilot's parser, which searches for keys, needs

Source: ArduPilot, libraries/SITL/examples/JSON/readme.md and SIM_JSON.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Final

from firmware_sim.guests.body import Motion

CHANNELS: Final = {18458: 16, 29569: 32}                # by magic number
HEAD: Final = struct.Struct("<HHI")
PWM_LOW_US, PWM_HIGH_US = 1_000, 2_000


@dataclass(frozen=True, slots=True)
class Servos:
    rate_hz: int
    count: int
    pwm_us: tuple[int, ...]

    def commands(self) -> list[float]:
        """Return the commands of the channels: 0 at 1000 us, 1 at 2000 us."""
        return [(pulse - PWM_LOW_US) / (PWM_HIGH_US - PWM_LOW_US) for pulse in self.pwm_us]


def read_servos(data: bytes) -> Servos | None:
    """Return the servo outputs in a datagram; None if it holds none."""
    if len(data) < HEAD.size:
        return None
    magic, rate_hz, count = HEAD.unpack_from(data)
    channels = CHANNELS.get(magic)
    if channels is None or len(data) != HEAD.size + 2 * channels or not rate_hz:
        return None
    return Servos(rate_hz, count, struct.unpack_from(f"<{channels}H", data, HEAD.size))


def state_text(motion: Motion, time_s: float) -> bytes:
    return b"\n" + json.dumps({
        "timestamp": time_s,
        "imu": {"gyro": motion.rates_radps, "accel_body": motion.force_mps2},
        "position": motion.position_ned_m,
        "quaternion": motion.quaternion_wxyz,
        "velocity": motion.velocity_ned_mps,
    }, allow_nan=False).encode() + b"\n"
