"""Failsafes: the mode to change to when motion capture, the link or the stream of targets is lost in flight.

    motion capture lost and needed               ->  LAND, by dead reckoning until it is back
    link lost                                    ->  as LINK_LOSS_ACT says: hold and then land, land, return
    targets lost in a mode that follows them     ->  HOLD, without motion capture LAND

They are checked in this order. A vehicle that lands or returns already goes on. When the link is back, the hold ends
and the vehicle stays at its place until the ground commands something else. A landing is always completed.
"""

from __future__ import annotations

from dataclasses import dataclass

from firmware_sim.autopilot.modes import MODES
from firmware_sim.autopilot.vehicle import Mode, Parameters

MOCAP_LOST = "motion capture lost: descend"
LINK_HOLD, LINK_LAND, LINK_RETURN = "link lost: hold", "link lost: land", "link lost: return"
TARGETS_HOLD, TARGETS_LAND = "targets lost: hold", "targets lost: land"


@dataclass(frozen=True, slots=True)
class Silences:
    """The ages of the link and the targets, and whether the flight has and needs a position."""

    link_ns: int                # since the last frame of the link
    targets_ns: int             # since the last target
    position_valid: bool
    position_needed: bool


class Failsafe:
    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self.acting = ""            # text of the failsafe in force; "": none
        self._held_ns = 0           # start of the hold after a loss of the link

    def clear(self) -> None:
        self.acting = ""

    def look(self, now_ns: int, mode: Mode, silences: Silences) -> Mode | None:
        """Return the mode to change to, None: no change; `acting` is the reason."""
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
