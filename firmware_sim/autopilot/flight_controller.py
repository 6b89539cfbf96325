"""The flight controller: arming, commands, modes and failsafes around the flight. It implements `Vehicle`.

Invariants:
- motors turn only while armed; only `arm` arms;
- a mode changes by a command, by an event of the flight (`modes.AFTER`) or by a failsafe, each with a notice;
- no target, frame or parameter raises an exception.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import acos, isfinite

from mypy_extensions import mypyc_attr

from firmware_sim.autopilot import mission_run, refusals
from firmware_sim.autopilot.airframe import Airframe
from firmware_sim.autopilot.failsafe import Failsafe, Silences
from firmware_sim.autopilot.flight import OFF_GROUND_M, STAY, Flight
from firmware_sim.autopilot.flight_loops import FlightLoops
from firmware_sim.autopilot.frames import down_axis
from firmware_sim.autopilot.mission_run import MissionRun
from firmware_sim.autopilot.mixer import Motors
from firmware_sim.autopilot.modes import AFTER, MODES, needs_position
from firmware_sim.autopilot.parameters import ParameterTable
from firmware_sim.autopilot.position_estimator import LONG_AGO_NS
from firmware_sim.autopilot.refusals import Facts
from firmware_sim.autopilot.target_limits import limited
from firmware_sim.autopilot.vehicle import (
    Landed,
    MissionItem,
    Mode,
    Notice,
    Quaternion,
    Result,
    Severity,
    Target,
    Vector,
    VehicleState,
)


@mypyc_attr(allow_interpreted_subclasses=True)
class FlightController:
    def __init__(self, airframe: Airframe, period_ns: int, navigation_every: int,
                 parameters: Mapping[str, float] | None = None) -> None:
        self.loops = FlightLoops(airframe, period_ns / 1e9, period_ns * navigation_every / 1e9)
        self.parameters = ParameterTable(parameters or {}, self._tune)
        self.on_notice: Notice = lambda _severity, _text: None
        self._tune()
        self._flight = Flight(self.loops, self.parameters, lambda text: self.on_notice(Severity.INFO, text))
        self._failsafe = Failsafe(self.parameters)
        self._every, self._ticks = navigation_every, 0
        self._now_ns = 0
        self._armed, self._mode = False, Mode.HOLD
        self._target_ns = self._link_ns = LONG_AGO_NS
        self._ground_ns = 0                     # local time since which the vehicle has stood armed

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
        return self._flight.mission.items

    @property
    def position_valid(self) -> bool:
        return self.loops.estimate.age_ns(self._now_ns) <= self.parameters.get("MOCAP_LOSS") * 1e9

    def state(self) -> VehicleState:
        estimate, flight, run = self.loops.estimate, self._flight, self._flight.mission
        index = run.index if self._mode is Mode.MISSION or (run.items and run.item is None) else -1
        return VehicleState(self._now_ns, estimate.position, estimate.velocity, self.loops.quaternion, self.loops.rates,
                            self._armed, self._mode, flight.landed, self._failsafe.acting, index, self.position_valid)

    def arm(self, force: bool = False) -> Result:
        if self._armed:
            return Result.ACCEPTED
        if why := refusals.arming(self._mode, self._facts(), force):
            self.on_notice(Severity.ERROR, f"arming refused: {why}")
            return Result.TEMPORARILY_REJECTED
        self._armed, self._ground_ns = True, self._now_ns
        self._link_ns = max(self._link_ns, self._now_ns)
        self._flight.arm()
        self._enter(self._mode, "armed")
        return Result.ACCEPTED

    def disarm(self, force: bool = False) -> Result:
        if not self._armed:
            return Result.ACCEPTED
        if not self._on_ground and not force:
            self.on_notice(Severity.ERROR, "disarming refused: in the air")
            return Result.TEMPORARILY_REJECTED
        self._stop("disarmed")
        return Result.ACCEPTED

    def set_mode(self, mode: Mode) -> Result:
        if mode is Mode.TAKEOFF:
            return self.take_off(self.parameters.get("MIS_TAKEOFF_ALT"))
        if mode is Mode.MISSION:
            run = self._flight.mission
            return self.start_mission(run.index if run.item else 0)
        return self._try(mode)

    def take_off(self, height_m: float) -> Result:
        if not isfinite(height_m) or height_m <= OFF_GROUND_M:
            return self._refused(f"take-off to {height_m:g} m", Result.DENIED)
        if self._armed and self._mode is Mode.TAKEOFF:      # a repeated command
            return Result.ACCEPTED
        most = self.parameters.get("FENCE_ALT") + self._flight.home[2]
        if height_m > most:
            self.on_notice(Severity.WARNING, f"take-off height {height_m:g} clipped to {most:.3g}")
            height_m = most
        result = self._try(Mode.TAKEOFF)
        if result is Result.ACCEPTED:
            self._flight.climb_to(height_m)
        return result

    def land(self) -> Result:
        return self._try(Mode.LAND)

    def target(self, target: Target, now_ns: int) -> list[str]:
        taken, said = limited(target, self.parameters)
        if taken is not None:
            self._flight.target, self._target_ns = taken, now_ns
        return said

    def load_mission(self, items: Sequence[MissionItem]) -> Result:
        if self._armed and self._mode is Mode.MISSION:
            return self._refused("mission: one is being flown")
        if why := mission_run.complaint(items, self.parameters):
            return self._refused(f"mission: {why}", Result.DENIED)
        self._flight.mission = MissionRun(tuple(items))
        if self._mode is Mode.MISSION:
            self._enter(Mode.HOLD, "new mission")
        return Result.ACCEPTED

    def start_mission(self, first: int = 0) -> Result:
        run = self._flight.mission
        if not 0 <= first < len(run.items):
            return self._refused(f"mission: no item {first}", Result.DENIED)
        if self._mode is Mode.MISSION and run.index == first:
            return Result.ACCEPTED
        result = self._try(Mode.MISSION)
        if result is Result.ACCEPTED:
            run.start(first, self.loops.estimate.position)
        return result

    def link_heard(self, now_ns: int) -> None:
        self._link_ns = now_ns

    # --- navigation

    def _navigate(self, now_ns: int) -> None:
        loops, flight = self.loops, self._flight
        loops.predict(now_ns)
        if self._on_ground:
            loops.estimate.stand()
        if not self._armed:
            return
        self._watch(now_ns)
        if not self._armed:
            return
        if self._on_ground and not flight.requests_flight(self._mode, self._targets_fresh):
            loops.idle()
            idle_s = self.parameters.get("DISARM_IDLE")
            if idle_s and now_ns - self._ground_ns > idle_s * 1e9:
                self._stop("disarmed: idle on the ground")
            return
        event = flight.step(now_ns, self._mode, self.position_valid, self._targets_fresh)
        if self._on_ground:
            self._ground_ns = now_ns
        if event and (after := AFTER.get((self._mode, event))):
            if after.to is None:
                self._stop(after.notice)
            else:
                self._enter(after.to, after.notice)
        elif self._on_ground:
            loops.idle()

    def _watch(self, now_ns: int) -> None:
        """Change the mode if a failsafe requires it."""
        self._link_ns, self._target_ns = min(self._link_ns, now_ns), min(self._target_ns, now_ns)  # clock set back
        attitude_told = self._flight.attitude_told
        told_ns = self._target_ns if self._mode is Mode.OFFBOARD or attitude_told else LONG_AGO_NS
        silences = Silences(now_ns - self._link_ns, 0 if self._on_ground else now_ns - told_ns, self.position_valid,
                            needs_position(self._mode, attitude_told))
        before = self._failsafe.acting
        mode = self._failsafe.look(now_ns, self._mode, silences)
        acting = self._failsafe.acting
        if mode is not None and self._on_ground:
            self._stop(f"disarmed: {acting}")
        elif mode is not None:
            self._begin(mode, acting, Severity.CRITICAL)
        elif before and not acting:
            self.on_notice(Severity.NOTICE, f"over: {before}")

    # --- small parts

    def _tune(self) -> None:
        self.loops.tune(self.parameters)

    def _facts(self) -> Facts:
        link_lost_ns = self.parameters.get("LINK_LOSS") * 1e9
        return Facts(self._armed, self._on_ground, self.position_valid, self._targets_fresh, self._flight.attitude_told,
                     not self.parameters.get("LINK_LOSS_ACT") or self._now_ns - self._link_ns <= link_lost_ns,
                     acos(max(-1.0, min(1.0, down_axis(self.loops.quaternion)[2]))))

    @property
    def _on_ground(self) -> bool:
        return self._flight.landed is Landed.ON_GROUND

    @property
    def _targets_fresh(self) -> bool:
        age_ns = self._now_ns - self._target_ns
        return self._flight.target is not None and age_ns <= self.parameters.get("OFFB_LOSS") * 1e9

    def _try(self, mode: Mode) -> Result:
        """Enter `mode`, by a command, or refuse it."""
        if why := refusals.entering(mode, self._facts()):
            return self._refused(f"{mode.value}: {why}")
        self._failsafe.clear()
        self._ground_ns = self._now_ns
        self._begin(mode, f"mode {mode.value}")
        return Result.ACCEPTED

    def _begin(self, mode: Mode, why: str, severity: Severity = Severity.INFO) -> None:
        """Enter a mode by a command or a failsafe, which sets a new goal."""
        self._flight.goal = self._flight.way_home if mode is Mode.RETURN else STAY
        self._enter(mode, why, severity)

    def _enter(self, mode: Mode, why: str, severity: Severity = Severity.INFO) -> None:
        self._mode = mode
        self.on_notice(severity, why)

    def _stop(self, why: str) -> None:
        self._armed = False
        self._flight.stop()
        self._failsafe.clear()
        self._enter(MODES[self._mode].disarmed, why, Severity.NOTICE)

    def _refused(self, why: str, result: Result = Result.TEMPORARILY_REJECTED) -> Result:
        self.on_notice(Severity.WARNING, f"refused: {why}"[:50])
        return result
