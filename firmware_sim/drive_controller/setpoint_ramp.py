"""Reference speeds of the wheels: those of the setpoint while running, otherwise ramped down to zero.

While running they change by at most `ramp_radps2`, if set, for motors that cannot accelerate faster. Both wheels change
in proportion, the one with the larger change by the ramp, so a robot that stops stays on its arc.
"""

from __future__ import annotations

from dataclasses import dataclass

from firmware_sim.drive_controller.drive_messages import DriveState, Setpoint


@dataclass
class SetpointRamp:
    stop_ramp_radps2: float         # > 0
    ramp_radps2: float = 0.0        # while running; 0: at once
    left_radps: float = 0.0
    right_radps: float = 0.0

    def follow(self, state: DriveState, setpoint: Setpoint | None, elapsed_ns: int) -> None:
        """Update the speeds; `elapsed_ns` is the local time since the last call."""
        running = state is DriveState.RUNNING and setpoint is not None
        left, right = (setpoint.left_radps, setpoint.right_radps) if running and setpoint else (0.0, 0.0)
        ramp = self.ramp_radps2 if running else self.stop_ramp_radps2
        longest = max(abs(left - self.left_radps), abs(right - self.right_radps))
        step = ramp * elapsed_ns / 1e9
        if step < longest and not (running and ramp == 0):
            left = self.left_radps + (left - self.left_radps) * step / longest
            right = self.right_radps + (right - self.right_radps) * step / longest
        self.left_radps, self.right_radps = left, right

    @property
    def at_rest(self) -> bool:
        return self.left_radps == 0.0 == self.right_radps
