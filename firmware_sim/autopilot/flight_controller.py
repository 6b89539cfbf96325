"""The flight controller: modes, arming, commands and failsafes around the loops. It implements `Vehicle`.

    disarmed --arm--> ON_GROUND (idle) --goal above the ground--> TAKING_OFF --> IN_AIR --LAND--> LANDING
        ^                  |                                                                        |
        +--disarm, idle too long, failsafe on the ground--+<------------------- stands -------------+

HOLD, TAKEOFF, MISSION, RETURN, LAND and position targets need motion capture; STABILIZE and attitude targets do not. A
landing goes on without it. After LAND the motors stop and the mode is HOLD.

Invariants:
- motors turn only while armed; only `arm` arms;
- a mode changes by a command, by its own end (TAKEOFF, RETURN, MISSION, LAND) or by a failsafe, each with a notice;
- no target, frame or parameter raises an exception.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import acos, dist, isfinite

from firmware_sim.autopilot import mission_run, refusals
from firmware_sim.autopilot.airframe import Airframe
from firmware_sim.autopilot.failsafe import Failsafe, Silences
from firmware_sim.autopilot.flight_loops import FlightLoops
from firmware_sim.autopilot.frames import down_axis
from firmware_sim.autopilot.landing_detector import LandingDetector
from firmware_sim.autopilot.mission_run import MissionRun
from firmware_sim.autopilot.mixer import Motors
from firmware_sim.autopilot.parameters import ParameterTable
from firmware_sim.autopilot.position_estimator import LONG_AGO_NS
from firmware_sim.autopilot.refusals import Facts, needs_position
from firmware_sim.autopilot.target_limits import limited
from firmware_sim.autopilot.vehicle import (
    AttitudeTarget,
    ItemKind,
    Landed,
    MissionItem,
    Mode,
    Notice,
    PositionTarget,
    Quaternion,
    Result,
    Severity,
    Target,
    Vector,
    VehicleState,
)

OFF_GROUND_M = 0.1          # height above which the vehicle flies
STANDS_BELOW_M = 0.25       # largest height at which it can stand; the ground is assumed flat
LIFTS_OFF = 0.3             # share of the hovering thrust above which an attitude target requests a lift-off
STAY = PositionTarget()
TOLD = (Mode.OFFBOARD, Mode.STABILIZE)      # modes that follow a stream of targets


class FlightController:
    def __init__(self, airframe: Airframe, period_ns: int, navigation_every: int,
                 parameters: Mapping[str, float] | None = None) -> None:
        self.loops = FlightLoops(airframe, period_ns / 1e9, period_ns * navigation_every / 1e9)
        self.parameters = ParameterTable(parameters or {}, self._tune)
        self.on_notice: Notice = lambda _severity, _text: None
        self._tune()
        self._failsafe = Failsafe(self.parameters)
        self._detector = LandingDetector()
        self._every, self._ticks = navigation_every, 0
        self._now_ns = 0
        self._armed, self._mode, self._landed = False, Mode.HOLD, Landed.ON_GROUND
        self._run = MissionRun()
        self._goal = STAY                       # target of all modes but OFFBOARD, STABILIZE and MISSION
        self._positional = False                # True while the position ramps are in use
        self._home: Vector = (0.0, 0.0, 0.0)
        self._target: Target | None = None
        self._target_ns = self._link_ns = LONG_AGO_NS
        self._ground_ns = 0                     # since when it stands armed

    # --- calls of the board's tasks

    def tick(self, now_ns: int, quaternion: Quaternion, rates: Vector, force: Vector) -> Motors:
        """Take the sensors' values and return the motor speeds; called once every period."""
        loops = self.loops
        loops.quaternion, loops.rates, loops.force = quaternion, rates, force
        if self._ticks % self._every == 0:
            self._now_ns = now_ns
            self._navigate(now_ns)
        self._ticks += 1
        return loops.motors()

    def captured(self, exposed_ns: int, position_ned_m: Vector, now_ns: int) -> bool:
        """Take a frame of motion capture; False if it is refused: too old, repeated, from the future or not finite."""
        return self.loops.estimate.correct(exposed_ns, position_ned_m, now_ns)

    # --- Vehicle

    @property
    def mission(self) -> Sequence[MissionItem]:
        return self._run.items

    @property
    def position_valid(self) -> bool:
        return self.loops.estimate.age_ns(self._now_ns) <= self.parameters.get("MOCAP_LOSS") * 1e9

    def state(self) -> VehicleState:
        estimate, run = self.loops.estimate, self._run
        index = run.index if self._mode is Mode.MISSION or (run.items and run.item is None) else -1
        return VehicleState(self._now_ns, estimate.position, estimate.velocity, self.loops.quaternion, self.loops.rates,
                            self._armed, self._mode, self._landed, self._failsafe.acting, index, self.position_valid)

    def arm(self, force: bool = False) -> Result:
        if self._armed:
            return Result.ACCEPTED
        if why := refusals.arming(self._mode, self._facts(), force):
            self.on_notice(Severity.ERROR, f"arming refused: {why}")
            return Result.TEMPORARILY_REJECTED
        loops = self.loops
        self._armed, self._home, self._ground_ns = True, loops.estimate.position, self._now_ns
        self._link_ns = max(self._link_ns, self._now_ns)
        loops.ground_down = self._home[2]
        loops.idle()
        self._enter(self._mode, "armed")
        return Result.ACCEPTED

    def disarm(self, force: bool = False) -> Result:
        if not self._armed:
            return Result.ACCEPTED
        if self._landed is not Landed.ON_GROUND and not force:
            self.on_notice(Severity.ERROR, "disarming refused: in the air")
            return Result.TEMPORARILY_REJECTED
        self._stop("disarmed")
        return Result.ACCEPTED

    def set_mode(self, mode: Mode) -> Result:
        if mode is Mode.TAKEOFF:
            return self.take_off(self.parameters.get("MIS_TAKEOFF_ALT"))
        if mode is Mode.MISSION:
            return self.start_mission(self._run.index if self._run.item else 0)
        return self._try(mode)

    def take_off(self, height_m: float) -> Result:
        if not isfinite(height_m) or height_m <= OFF_GROUND_M:
            return self._refused(f"take-off to {height_m:g} m", Result.DENIED)
        if self._armed and self._mode is Mode.TAKEOFF:      # a repeated command
            return Result.ACCEPTED
        most = self.parameters.get("FENCE_ALT") + self._home[2]
        if height_m > most:
            self.on_notice(Severity.WARNING, f"take-off height {height_m:g} clipped to {most:.3g}")
            height_m = most
        result = self._try(Mode.TAKEOFF)
        if result is Result.ACCEPTED:
            self._goal = PositionTarget((self._home[0], self._home[1], self._home[2] - height_m))
        return result

    def land(self) -> Result:
        return self._try(Mode.LAND)

    def target(self, target: Target, now_ns: int) -> list[str]:
        taken, said = limited(target, self.parameters)
        if taken is not None:
            self._target, self._target_ns = taken, now_ns
        return said

    def load_mission(self, items: Sequence[MissionItem]) -> Result:
        if self._armed and self._mode is Mode.MISSION:
            return self._refused("mission: one is being flown")
        if why := mission_run.complaint(items, self.parameters):
            return self._refused(f"mission: {why}", Result.DENIED)
        self._run = MissionRun(tuple(items))
        if self._mode is Mode.MISSION:
            self._enter(Mode.HOLD, "new mission")
        return Result.ACCEPTED

    def start_mission(self, first: int = 0) -> Result:
        if not 0 <= first < len(self._run.items):
            return self._refused(f"mission: no item {first}", Result.DENIED)
        if self._mode is Mode.MISSION and self._run.index == first:
            return Result.ACCEPTED
        result = self._try(Mode.MISSION)
        if result is Result.ACCEPTED:
            self._run.start(first, self.loops.estimate.position)
        return result

    def link_heard(self, now_ns: int) -> None:
        self._link_ns = now_ns

    # --- navigation

    def _navigate(self, now_ns: int) -> None:
        loops = self.loops
        loops.predict(now_ns)
        if self._landed is Landed.ON_GROUND:
            loops.estimate.stand()
        if not self._armed:
            return
        self._watch(now_ns)
        if not self._armed:
            return
        if self._landed is Landed.ON_GROUND and not self._requests_flight():
            loops.idle()
            idle_s = self.parameters.get("DISARM_IDLE")
            if idle_s and now_ns - self._ground_ns > idle_s * 1e9:
                self._stop("disarmed: idle on the ground")
            return
        if self._landed is Landed.ON_GROUND:
            self._landed = Landed.TAKING_OFF
            self._detector.restart()
            loops.begin(fresh=True)
        self._fly()
        self._update_phase(now_ns)

    def _watch(self, now_ns: int) -> None:
        """Change the mode if a failsafe requires it."""
        self._link_ns, self._target_ns = min(self._link_ns, now_ns), min(self._target_ns, now_ns)  # clock set back
        told_ns = self._target_ns if self._mode is Mode.OFFBOARD or self._follows_attitude else LONG_AGO_NS
        silences = Silences(now_ns - self._link_ns, 0 if self._landed is Landed.ON_GROUND else now_ns - told_ns,
                            self.position_valid, needs_position(self._mode, self._follows_attitude))
        before = self._failsafe.acting
        mode = self._failsafe.look(now_ns, self._mode, silences)
        acting = self._failsafe.acting
        if mode is not None and self._landed is Landed.ON_GROUND:
            self._stop(f"disarmed: {acting}")
        elif mode is not None:
            self._goal = STAY if mode is not Mode.RETURN else self._return_target()
            self._enter(mode, acting, Severity.CRITICAL)
        elif before and not acting:
            self.on_notice(Severity.NOTICE, f"over: {before}")

    def _fly(self) -> None:
        loops, mode = self.loops, self._mode
        if mode in TOLD and isinstance(self._target, AttitudeTarget):
            self._positional = False
            loops.aim(self._target)
            return
        if not self.position_valid and mode is Mode.LAND:
            self._positional = False
            loops.descend()
            return
        if not self._positional:
            self._positional = True
            loops.begin(fresh=False)
        loops.follow(self._current_target())

    def _current_target(self) -> PositionTarget:
        mode, land_speed = self._mode, self.parameters.get("LAND_SPEED")
        if mode is Mode.OFFBOARD and isinstance(self._target, PositionTarget):
            return self._target
        if mode is Mode.LAND:
            north, east, _ = self._goal.position_ned_m
            return PositionTarget((north, east, None), (None, None, land_speed))
        if mode is Mode.MISSION:
            return self._run.goal(land_speed)
        return self._goal

    def _requests_flight(self) -> bool:
        if self._mode in TOLD and not self._targets_fresh:
            return False
        if self._mode in TOLD and isinstance(self._target, AttitudeTarget):
            return self._target.thrust * self.loops.airframe.full_thrust_n > LIFTS_OFF * self.loops.hover_n
        goal = self._current_target()
        down, climb = goal.position_ned_m[2], goal.velocity_ned_mps[2]
        return down < self.loops.ground_down - OFF_GROUND_M if down is not None else (climb or 0.0) < 0

    def _update_phase(self, now_ns: int) -> None:
        """End the phase of flight if the vehicle has left the ground, arrived or landed."""
        loops = self.loops
        descends = self._mode is Mode.LAND
        low = loops.height_m < STANDS_BELOW_M or not self.position_valid
        if low and (descends or self._landed is not Landed.TAKING_OFF or not self._requests_flight()):
            if self._detector.stands(now_ns, loops.thrust_n, loops.hover_n, loops.force, loops.rates):
                self._on_the_ground(now_ns)
                return
        else:
            self._detector.restart()
        flies = self._landed is not Landed.TAKING_OFF or loops.height_m > OFF_GROUND_M
        if flies and self._mode is not Mode.TAKEOFF:
            self._landed = Landed.LANDING if descends else Landed.IN_AIR
        position = loops.estimate.position
        if self._mode is Mode.MISSION:
            self._fly_mission(now_ns, position)
        elif self._mode in (Mode.TAKEOFF, Mode.RETURN) and self._arrived(position):
            if self._mode is Mode.TAKEOFF:
                self._landed = Landed.IN_AIR
                self._enter(Mode.HOLD, "take-off done")
            else:
                self._enter(Mode.LAND, "home: landing")

    def _fly_mission(self, now_ns: int, position: Vector) -> None:
        run, before = self._run, self._run.goal(0.0)
        if run.advance(now_ns, position, self.parameters.get("NAV_ACC_RAD")):
            self.on_notice(Severity.INFO, f"mission item {run.index - 1} reached")
        if run.item is None:
            self._goal = PositionTarget(before.position_ned_m)
            self._enter(Mode.HOLD, "mission done")
        elif run.item.kind is ItemKind.RETURN:
            run.landed(position)
            self._goal = self._return_target()
            self._enter(Mode.RETURN, "mission: returning home")

    def _on_the_ground(self, now_ns: int) -> None:
        self._landed, self._ground_ns, self._positional = Landed.ON_GROUND, now_ns, False
        self.loops.ground_down = self.loops.estimate.position[2] if self.position_valid else self.loops.ground_down
        self._detector.restart()
        item = self._run.item
        if self._mode is Mode.MISSION and item is not None and item.kind is ItemKind.LAND:
            self._run.landed(self.loops.estimate.position)
            self._stop("landed: mission done" if self._run.item is None else "landed: mission rests")
        elif self._mode is Mode.LAND:
            self._stop("landed")
        else:
            self.loops.idle()

    # --- small parts

    def _tune(self) -> None:
        self.loops.tune(self.parameters)

    def _facts(self) -> Facts:
        link_lost_ns = self.parameters.get("LINK_LOSS") * 1e9
        return Facts(self._armed, self._landed is Landed.ON_GROUND, self.position_valid, self._targets_fresh,
                     self._follows_attitude,
                     not self.parameters.get("LINK_LOSS_ACT") or self._now_ns - self._link_ns <= link_lost_ns,
                     acos(max(-1.0, min(1.0, down_axis(self.loops.quaternion)[2]))))

    @property
    def _targets_fresh(self) -> bool:
        return self._target is not None and self._now_ns - self._target_ns <= self.parameters.get("OFFB_LOSS") * 1e9

    @property
    def _follows_attitude(self) -> bool:
        return isinstance(self._target, AttitudeTarget)

    def _return_target(self) -> PositionTarget:
        least = self._home[2] - self.parameters.get("RTL_RETURN_ALT")
        return PositionTarget((self._home[0], self._home[1], min(least, self.loops.estimate.position[2])))

    def _arrived(self, position: Vector) -> bool:
        goal = [a for a in self._goal.position_ned_m if a is not None]
        return dist(goal, position) < self.parameters.get("NAV_ACC_RAD")

    def _try(self, mode: Mode) -> Result:
        """Enter `mode`, by a command, or refuse it."""
        if why := refusals.entering(mode, self._facts()):
            return self._refused(f"{mode.value}: {why}")
        self._goal = self._return_target() if mode is Mode.RETURN else STAY
        self._failsafe.clear()
        self._ground_ns = self._now_ns
        self._enter(mode, f"mode {mode.value}")
        return Result.ACCEPTED

    def _enter(self, mode: Mode, why: str, severity: Severity = Severity.INFO) -> None:
        self._mode = mode
        self.on_notice(severity, why)

    def _stop(self, why: str) -> None:
        self._armed, self._landed, self._positional, self._goal = False, Landed.ON_GROUND, False, STAY
        self.loops.stop()
        self._failsafe.clear()
        self._enter(Mode.HOLD if self._mode is not Mode.STABILIZE else self._mode, why, Severity.NOTICE)

    def _refused(self, why: str, result: Result = Result.TEMPORARILY_REJECTED) -> Result:
        self.on_notice(Severity.WARNING, f"refused: {why}"[:50])
        return result
