"""A vehicle of a convoy on a straight road: it says where it is, and keeps its distance to the one ahead.

    each period    place, speed --broadcast--> the others
    leader         cruise speed, or slower if it waits and the last vehicle that it hears is too far behind
    follower       v = v_ahead + gain (gap - wanted gap), within [0, v_max]; its last command for `hold_ns` after the
                   last frame of the vehicle ahead, then it stops

The constant-spacing law with the speed of the one ahead fed forward is that of Swaroop and Hedrick (1999), "Constant
spacing strategies for platooning in automated highway systems", ASME J. Dyn. Sys. Meas. Control 121(3), without the
acceleration. Place is that of the vehicle's odometry, without error.

Not modelled: steering, which is straight ahead; two vehicles at one place.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from math import isfinite
from typing import ClassVar, Final

from firmware_sim.board import Board

FRAME: Final = struct.Struct("<Bdd")        # number in the convoy, x [m], v [m/s]


@dataclass(frozen=True)
class VehicleSettings:
    """`number` 0 leads; the others follow the one before. The first frame comes at `offset_ns`."""

    number: int
    count: int
    period_ns: int = 100_000_000
    offset_ns: int = 0
    cruise_mps: float = 2.0
    v_max_mps: float = 3.0
    gap_m: float = 10.0
    gain_per_s: float = 0.5
    waits: bool = True              # the leader slows down for those behind
    most_gap_m: float = 20.0        # between leader and last, per vehicle behind
    hold_ns: int = 500_000_000

    def __post_init__(self) -> None:
        if not 0 <= self.number < self.count <= 256:
            raise ValueError(f"number={self.number}: expected 0 <= number < count ({self.count}) <= 256")
        if self.period_ns < 1 or self.hold_ns < 0:
            raise ValueError(f"period_ns={self.period_ns}, hold_ns={self.hold_ns}: expected a period of more than 0 "
                             "and a hold of at least 0")


class Vehicle:
    Settings: ClassVar = VehicleSettings

    def __init__(self, board: Board, settings: VehicleSettings) -> None:
        self._board, self._settings = board, settings
        self._port = board.port(board.ports[0], self._hear, listen_only=True)
        self._heard: dict[int, tuple[int, float, float]] = {}       # by number: (local time, x, v)
        self._speed = 0.0
        board.count("stops", 0)
        board.count("unreadable frames", 0)
        board.record_all([("speed_command", "m/s"), ("gap", "m")], lambda: (self._speed, self._gap()))
        board.every(settings.period_ns, self._drive, offset_ns=settings.offset_ns)

    def _hear(self, data: bytes) -> None:
        if len(data) != FRAME.size:
            self._board.count("unreadable frames")
            return
        number, x, v = FRAME.unpack(data)
        if number >= self._settings.count or not (isfinite(x) and isfinite(v)):
            self._board.count("unreadable frames")
            return
        self._heard[number] = self._board.now_ns, x, v

    def _drive(self) -> None:
        speed = self._lead() if self._settings.number == 0 else self._follow()
        if speed == 0.0 < self._speed:
            self._board.count("stops")
            self._board.event("stopped", "the vehicle ahead was not heard" if self._settings.number else
                              "the others are too far behind")
        self._speed = speed
        self._board.actuate("v_cmd", speed)
        self._port.send(FRAME.pack(self._settings.number, self._board.sense("x"), speed))

    def _lead(self) -> float:
        settings = self._settings
        last = self._heard.get(settings.count - 1)
        if not settings.waits or last is None:
            return settings.cruise_mps
        behind_m = float(self._board.sense("x")) - last[1]
        allowed_m = settings.most_gap_m * (settings.count - 1)
        return max(0.0, min(settings.cruise_mps, settings.cruise_mps + settings.gain_per_s * (allowed_m - behind_m)))

    def _follow(self) -> float:
        settings = self._settings
        ahead = self._heard.get(settings.number - 1)
        if ahead is None or self._board.now_ns - ahead[0] > settings.hold_ns:
            return 0.0
        _, x, v = ahead
        wanted = v + settings.gain_per_s * (x - float(self._board.sense("x")) - settings.gap_m)
        return max(0.0, min(settings.v_max_mps, wanted))

    def _gap(self) -> float:
        """Distance to the vehicle ahead as it was heard last [m]; 0 for the leader, and before any was heard."""
        ahead = self._heard.get(self._settings.number - 1)
        return 0.0 if ahead is None else ahead[1] - float(self._board.sense("x"))
