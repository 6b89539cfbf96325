"""A tracking robot that predicts the tracking error between looks instead of holding its measurement (section 4.7).

    measurement:        the reference's pose as measured, and its inputs, at the instant of the look
    control instant:    R2's pose moved on by its inputs, own pose by odometry; u by (4.4) from their difference
    next look:          when the error of the prediction could exceed `tolerance` (`predicted_error`)

Everything else is the `TrackingRobot`: looks, drive, assumptions. Its odometry replaces the model of R1, so wheels that
do not follow the command are seen. The signals `held1` to `held3` are the prediction at the last control instant.

Not modelled: the delay of the look in the bound of the error; slip.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, remainder

from agents.tracking.arcs import arc
from agents.tracking.controller import Command, Pose, placed, tracking_error
from agents.tracking.look_frames import ReferenceState
from agents.tracking.predicted_error import PredictedError
from agents.tracking.tracking_robot import TrackingRobot
from agents.tracking.tracking_settings import TrackingSettings
from firmware_sim.board import Board
from firmware_sim.board_timers import Timer


@dataclass(frozen=True)
class PredictingSettings(TrackingSettings):
    tolerance: float = 0.4                  # [m, rad] largest error of the prediction
    input_error: float = 0.3                # [m/s, rad/s] amplitude of e_omega
    control_ns: int = 10_000_000            # between two commands from the prediction

    def __post_init__(self) -> None:
        if self.control_ns < 1:
            raise ValueError(f"control_ns={self.control_ns}: expected 1 or more between two commands")
        self.trigger()

    def trigger(self) -> PredictedError:
        return PredictedError(self.tolerance, self.measurement_noise, self.input_error)


class PredictingRobot(TrackingRobot):
    Settings = PredictingSettings

    def __init__(self, board: Board, settings: PredictingSettings) -> None:
        super().__init__(board, settings)
        self._policy = settings.trigger()
        self._control_ns = settings.control_ns
        self._reference = Pose(0.0, 0.0, 0.0)       # as the last measurement has it
        self._reference_ns = 0
        self._next: Timer | None = None

    def _measured(self, state: ReferenceState, measured_ns: int, seen_ns: int) -> None:
        before = self._latest
        super()._measured(state, measured_ns, seen_ns)
        if self._latest is not before:
            self._reference, self._reference_ns = placed(self._place.pose_at(seen_ns), self._x), seen_ns
            self._arm()

    def _arm(self) -> None:
        if self._next is not None:
            self._next.cancel()
        self._next = self._board.at(self._board.now_ns + self._control_ns, self._follow)

    def _follow(self) -> None:
        """Command from the predicted tracking error."""
        now_ns, inputs, decision = self._board.now_ns, self._inputs, self._latest
        assert inputs is not None
        assert decision is not None
        reference = arc(self._reference, Command(*inputs), (now_ns - self._reference_ns) * 1e-9)
        x1, x2, x3 = tracking_error(self._place.pose_at(now_ns), reference)
        self._x = x1, x2, remainder(x3, 2 * pi)
        self._command = self._controller.command(self._x, inputs)
        self._tell_drive(decision)
        self._arm()
