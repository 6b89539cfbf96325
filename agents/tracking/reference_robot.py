"""The reference robot R2 of Chapter 4: it answers looks with its pose and inputs, and announces changes of its inputs.

It sends nominal inputs: the disturbance e_omega that acts on them (4.45) is unknown to all robots.

Plant: `virtual_reference`, driven by the pieces in the team's table `reference` (from_s, v_mps, omega_radps).
Not modelled: computing time between a request and its answer; an announcement that is lost is not repeated.
"""

from __future__ import annotations

from dataclasses import dataclass

from agents.tracking.check import reference_problems
from agents.tracking.controller import Inputs, Pose
from agents.tracking.look_frames import REQUEST_BYTES, UNASKED, ReferenceState, pack_answer, unpack_request
from agents.tracking.look_port import ANSWER_ID, LookPort
from agents.tracking.noise import Noise
from firmware_sim.board import Board


@dataclass(frozen=True)
class ReferenceSettings:
    disturbance: float = 0.0            # amplitude of e_omega [m/s, rad/s], `Noise.inputs`
    hold_ns: int = 10_000_000           # for which the plant gets a constant e_omega

    def __post_init__(self) -> None:
        if self.hold_ns < 1:
            raise ValueError(f"hold_ns={self.hold_ns}: expected at least 1")


class ReferenceRobot:
    Settings = ReferenceSettings
    check = staticmethod(reference_problems)

    def __init__(self, board: Board, settings: ReferenceSettings) -> None:
        self._board, self._hold_ns = board, settings.hold_ns
        self._state = board.sensors(["x", "y", "theta", "v", "omega"])
        self._disturb = board.actuators(["e_v", "e_omega"])
        self._noise = Noise(board.rng, board.rng, 0.0, settings.disturbance)
        self._port = LookPort(board, ANSWER_ID, REQUEST_BYTES, self._hear)
        board.count("unreadable frames", 0)
        board.record_all([("x", "m"), ("y", "m"), ("theta", "rad"), ("v", "m/s"), ("omega", "rad/s")],
                         self._state.read)
        for from_s in board.team["reference"]["from_s"]:
            if from_s > 0:
                board.at(round(from_s * 1e9), self._announce)
        if settings.disturbance:
            board.every(settings.hold_ns, self._drift, sends=False)

    def _say(self, look: int) -> None:
        x_m, y_m, theta_rad, v_mps, omega_rad_s = self._state.read()
        self._port.send(pack_answer(look, ReferenceState(Pose(x_m, y_m, theta_rad), Inputs(v_mps, omega_rad_s))))

    def _hear(self, data: bytes) -> None:
        look = unpack_request(data)
        if look is None:
            self._board.count("unreadable frames")
        else:
            self._say(look)

    def _announce(self) -> None:
        self._say(UNASKED)
        _, _, _, v_mps, omega_rad_s = self._state.read()
        self._board.event("switched inputs", f"to v = {v_mps:g} m/s, omega = {omega_rad_s:g} rad/s")

    def _drift(self) -> None:
        """Set the plant's disturbance to -e_omega (4.45), evaluated at the middle of the next `hold_ns`."""
        error = self._noise.input_error(self._board.now_ns + self._hold_ns // 2)
        self._disturb.write([-error.v_mps, -error.omega_rad_s])
