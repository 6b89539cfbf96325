"""The state of a drive, by the last setpoint received and its age on the local clock.

                   setpoint RUN                  none for stale_after
    STOPPED ---------------------> RUNNING -----------------------------> STALE
       ^       setpoint STOP          |  ^            setpoint RUN          |
       +------------------------------+  +----------------------------------+
       +--------------------------------- setpoint STOP --------------------+

A drive becomes STALE at the first release at or after heard_ns + stale_after_ns, when `look` is called. A drive that is
STOPPED needs no further setpoints.
"""

from __future__ import annotations

from firmware_sim.drive_controller.drive_messages import DriveState, Mode, Setpoint
from netem.wire.level import Level


class SetpointWatch:
    def __init__(self, stale_after_ns: int) -> None:
        self.stale_after_ns = stale_after_ns
        self.setpoint: Setpoint | None = None
        self.heard_ns = 0                   # local time of the last setpoint
        self.state = DriveState.STOPPED
        self._silent_ns = 0                 # length of the last time without setpoints

    def heard(self, setpoint: Setpoint, now_ns: int) -> None:
        if self.setpoint is not None and now_ns - self.heard_ns >= self.stale_after_ns:
            self._silent_ns = now_ns - self.heard_ns
        self.setpoint = setpoint
        self.heard_ns = now_ns

    def look(self, now_ns: int) -> tuple[str, str, Level] | None:
        """Update the state; return kind, detail and level of an event if it changed, else None."""
        before, self.state = self.state, self._state_at(now_ns)
        if self.state is before:
            return None
        if self.state is DriveState.STALE:
            return "setpoint stale", f"none for {(now_ns - self.heard_ns) / 1e6:g} ms: the wheels stop", Level.WARNING
        if before is DriveState.STALE:
            after = f"after {self._silent_ns / 1e6:g} ms; the drive is {self.state.name}"
            return "setpoint recovered", after, Level.INFO
        return f"drive {self.state.name.lower()}", "", Level.INFO

    def age_ns(self, now_ns: int) -> int | None:
        """Return the age of the last setpoint, None without one; at least 0, also if the clock was set back."""
        return None if self.setpoint is None else max(0, now_ns - self.heard_ns)

    def _state_at(self, now_ns: int) -> DriveState:
        if self.setpoint is None or self.setpoint.mode == Mode.STOP:
            return DriveState.STOPPED
        return DriveState.STALE if now_ns - self.heard_ns >= self.stale_after_ns else DriveState.RUNNING
