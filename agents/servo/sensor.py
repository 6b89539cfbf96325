"""The sensor of a servo: sends the position that the sensing medium detects, as soon as it is known."""

from __future__ import annotations

from dataclasses import dataclass

from agents.servo.messages import check_identifier, pack_number
from firmware_sim.board import Board
from netem.media.sensing.sight import Detection, unpack_sight


@dataclass(frozen=True)
class SensorSettings:
    encoder: str                    # the sensing medium
    measured_id: int
    bus: str = "can"

    def __post_init__(self) -> None:
        check_identifier("measured_id", self.measured_id)


class ServoSensor:
    Settings = SensorSettings

    def __init__(self, board: Board, settings: SensorSettings) -> None:
        self._settings = settings
        self._bus = board.port(settings.bus, lambda frame: None, listen_only=True)
        board.port(settings.encoder, self._seen)

    def _seen(self, frame: bytes) -> None:
        sight = unpack_sight(frame)
        if isinstance(sight, Detection):
            self._bus.send(pack_number(self._settings.measured_id, sight.x_m))
