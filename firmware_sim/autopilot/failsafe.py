"""What to do when something falls silent in flight: a new mode and a word for it, or nothing.

    motion capture silent, its position needed   ->  LAND, blind until it is back
    link silent                                  ->  as LINK_LOSS_ACT says: hold and then land, land, return
    targets silent in a mode that follows them   ->  HOLD, without motion capture LAND

They are looked at in this order. Who lands or returns already goes on. A link that is heard again ends the hold, and
the vehicle stays where it is: going on is the ground's decision. A landing is finished.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from firmware_sim.autopilot.modes import MODES
from firmware_sim.autopilot.vehicle import Mode, Parameters

MOCAP_LOST = "motion capture lost: descend"
LINK_HOLD, LINK_LAND, LINK_RETURN = "link lost: hold", "link lost: land", "link lost: return"
TARGETS_HOLD, TARGETS_LAND = "targets lost: hold", "targets lost: land"


@dataclass(frozen=True, slots=True)
class Silences:
    """How long ago things were heard, and what the flight needs."""

    link_ns: int
    targets_ns: int
    position_valid: bool
    position_needed: bool


@dataclass
class Failsafe:
    parameters: Parameters
    acting: str = ""
    _held_ns: int = field(default=0, init=False)        # since when the link's hold lasts

    def clear(self) -> None:
        self.acting = ""

    def look(self, now_ns: int, mode: Mode, silences: Silences) -> Mode | None:
        """The mode to change to; `acting` says why."""
        get = self.parameters.get
        if silences.position_needed and not silences.position_valid and self.acting != MOCAP_LOST:
            self.acting = MOCAP_LOST
            return Mode.LAND
        action = int(get("LINK_LOSS_ACT"))
        if action and silences.link_ns > get("LINK_LOSS") * 1e9:
            return self._link_lost(now_ns, mode, action, silences.position_valid)
        if self.acting == LINK_HOLD:
            self.acting = ""
        if MODES[mode].targets and silences.targets_ns > get("OFFB_LOSS") * 1e9:
            self.acting = TARGETS_HOLD if silences.position_valid else TARGETS_LAND
            return Mode.HOLD if silences.position_valid else Mode.LAND
        return None

    def _link_lost(self, now_ns: int, mode: Mode, action: int, position_valid: bool) -> Mode | None:
        if MODES[mode].homeward:
            return None
        if self.acting == LINK_HOLD:
            if now_ns - self._held_ns < self.parameters.get("LINK_HOLD") * 1e9:
                return None
            action = 2
        if action == 2 or not position_valid:
            self.acting = LINK_LAND
            return Mode.LAND
        self.acting, self._held_ns = (LINK_HOLD, now_ns) if action == 1 else (LINK_RETURN, now_ns)
        return Mode.HOLD if action == 1 else Mode.RETURN
