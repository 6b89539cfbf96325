"""Sets the goal of the control loops from the mode, the targets and the mission; tracks the phase of flight.

    ON_GROUND --goal above the ground--> TAKING_OFF --off the ground--> IN_AIR --mode LAND--> LANDING
        ^---------------------------- the landing detector finds the vehicle standing -----------------'

`step` changes no mode: it returns the event from which the flight controller looks the next mode up.
"""

from __future__ import annotations

from collections.abc import Callable
from math import dist

from firmware_sim.autopilot.flight_loops import FlightLoops
from firmware_sim.autopilot.landing_detector import LandingDetector
from firmware_sim.autopilot.mission_run import MissionRun
from firmware_sim.autopilot.modes import MODES, Event
from firmware_sim.autopilot.vehicle import (
    AttitudeTarget,
    ItemKind,
    Landed,
    Mode,
    Parameters,
    PositionTarget,
    Target,
    Vector,
)

OFF_GROUND_M = 0.1          # height above which the vehicle flies
STANDS_BELOW_M = 0.25       # largest height at which it can stand; the ground is assumed flat
LIFTS_OFF = 0.3             # share of the hovering thrust above which an attitude target requests a lift-off
STAY = PositionTarget()


class Flight:
    def __init__(self, loops: FlightLoops, parameters: Parameters, tell: Callable[[str], None]) -> None:
        self.loops = loops
        self.landed = Landed.ON_GROUND
        self.mission = MissionRun()
        self.goal = STAY                        # target of all modes but OFFBOARD, STABILIZE and MISSION
        self.home: Vector = (0.0, 0.0, 0.0)
        self.target: Target | None = None       # last target received
        self._parameters, self._tell = parameters, tell
        self._detector = LandingDetector()
        self._positional = False                # True while the position ramps are in use

    # --- calls of the flight controller

    def arm(self) -> None:
        self.home = self.loops.estimate.position
        self.loops.ground_down = self.home[2]
        self.loops.idle()

    def stop(self) -> None:
        self.landed, self._positional, self.goal = Landed.ON_GROUND, False, STAY
        self.loops.stop()

    def climb_to(self, height_m: float) -> None:
        """Set the goal to the point `height_m` above home."""
        self.goal = PositionTarget((self.home[0], self.home[1], self.home[2] - height_m))

    def step(self, now_ns: int, mode: Mode, position_valid: bool, targets_fresh: bool) -> Event | None:
        """Set the loops' goal for one period of the position loop and update the phase of flight.

        Called while the vehicle is armed and flies or `requests_flight`. Returns the event that has occurred, if any.
        """
        if self.landed is Landed.ON_GROUND:
            self.landed = Landed.TAKING_OFF
            self._detector.restart()
            self.loops.begin(fresh=True)
        self._fly(mode, position_valid)
        return self._progress(now_ns, mode, position_valid, targets_fresh)

    # --- state

    @property
    def attitude_told(self) -> bool:
        return isinstance(self.target, AttitudeTarget)

    @property
    def way_home(self) -> PositionTarget:
        least = self.home[2] - self._parameters.get("RTL_RETURN_ALT")
        return PositionTarget((self.home[0], self.home[1], min(least, self.loops.estimate.position[2])))

    def requests_flight(self, mode: Mode, targets_fresh: bool) -> bool:
        if MODES[mode].targets:
            if not targets_fresh:
                return False
            if isinstance(self.target, AttitudeTarget):
                return self.target.thrust * self.loops.airframe.full_thrust_n > LIFTS_OFF * self.loops.hover_n
        goal = self._current_target(mode)
        down, climb = goal.position_ned_m[2], goal.velocity_ned_mps[2]
        return down < self.loops.ground_down - OFF_GROUND_M if down is not None else (climb or 0.0) < 0

    # --- small parts

    def _fly(self, mode: Mode, position_valid: bool) -> None:
        loops, rules = self.loops, MODES[mode]
        if rules.targets and isinstance(self.target, AttitudeTarget):
            self._positional = False
            loops.aim(self.target)
        elif rules.blind and not position_valid:
            self._positional = False
            loops.descend()
        else:
            if not self._positional:
                self._positional = True
                loops.begin(fresh=False)
            loops.follow(self._current_target(mode))

    def _current_target(self, mode: Mode) -> PositionTarget:
        land_speed = self._parameters.get("LAND_SPEED")
        if mode is Mode.OFFBOARD and isinstance(self.target, PositionTarget):
            return self.target
        if mode is Mode.LAND:
            north, east, _ = self.goal.position_ned_m
            return PositionTarget((north, east, None), (None, None, land_speed))
        if mode is Mode.MISSION:
            return self.mission.goal(land_speed)
        return self.goal

    def _progress(self, now_ns: int, mode: Mode, position_valid: bool, targets_fresh: bool) -> Event | None:
        """End the phase of flight if the vehicle has left the ground, arrived or landed; return the event."""
        loops, descends = self.loops, mode is Mode.LAND
        low = loops.height_m < STANDS_BELOW_M or not position_valid
        if low and (descends or self.landed is not Landed.TAKING_OFF or not self.requests_flight(mode, targets_fresh)):
            if self._detector.stands(now_ns, loops.thrust_n, loops.hover_n, loops.force, loops.rates):
                return self._stand(mode, position_valid)
        else:
            self._detector.restart()
        flies = self.landed is not Landed.TAKING_OFF or loops.height_m > OFF_GROUND_M
        if flies and mode is not Mode.TAKEOFF:
            self.landed = Landed.LANDING if descends else Landed.IN_AIR
        position = loops.estimate.position
        if mode is Mode.MISSION:
            return self._fly_mission(now_ns, position)
        if mode in (Mode.TAKEOFF, Mode.RETURN) and self._arrived(position):
            if mode is Mode.TAKEOFF:
                self.landed = Landed.IN_AIR
            return Event.ARRIVED
        return None

    def _fly_mission(self, now_ns: int, position: Vector) -> Event | None:
        run, before = self.mission, self.mission.goal(0.0)
        if run.advance(now_ns, position, self._parameters.get("NAV_ACC_RAD")):
            self._tell(f"mission item {run.index - 1} reached")
        if run.item is None:
            self.goal = PositionTarget(before.position_ned_m)
            return Event.ITEMS_DONE
        if run.item.kind is ItemKind.RETURN:
            run.landed(position)
            self.goal = self.way_home
            return Event.ITEM_RETURNS
        return None

    def _stand(self, mode: Mode, position_valid: bool) -> Event:
        self.landed, self._positional = Landed.ON_GROUND, False
        position = self.loops.estimate.position
        if position_valid:
            self.loops.ground_down = position[2]
        self._detector.restart()
        item = self.mission.item
        if mode is not Mode.MISSION or item is None or item.kind is not ItemKind.LAND:
            return Event.STANDS
        self.mission.landed(position)
        return Event.LAST_ITEM_STANDS if self.mission.item is None else Event.ITEM_STANDS

    def _arrived(self, position: Vector) -> bool:
        goal = [a for a in self.goal.position_ned_m if a is not None]
        return dist(goal, position) < self._parameters.get("NAV_ACC_RAD")
