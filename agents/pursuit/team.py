"""Several sensors and targets without any network: the algorithm of Figure 3.3, instant by instant (section 3.3.2).

    all sensors     an idle one scans its escape area for targets that were not in its view an instant ago; one in
                    charge looks if a look is due, and reports every target that it detects
    idle ones       claim a target that entered, at random; its former sensor becomes idle and stays at its place
    ones in charge  apply the detections that the center passes on, decide, drive

As in `chase`, the true distance is measured from each target to the boundary of the view of the sensor in charge.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf
from random import Random

import numpy as np

from agents.estimation.circle_filter import CircleFilter
from agents.pursuit import Place
from agents.pursuit.chase import PARTS
from agents.pursuit.evaders import Evader
from agents.pursuit.fusion_center import FusionCenter, Reading
from agents.pursuit.law import PursuitLaw
from agents.pursuit.pursuer import Decision, Pursuer, adaptive_pursuer
from agents.pursuit.zones import Zones

Making = Callable[["Sensor"], Pursuer]


@dataclass
class Sensor:
    zones: Zones
    law: PursuitLaw
    sigma_m: float
    own: Place
    pursuer: Pursuer | None = None          # None: idle
    in_view: set[str] = field(default_factory=set)
    looks: int = 0
    look_ns: int = 0
    goal: Place | None = None


@dataclass
class Outcome:
    """Totals over one run."""

    least_m: dict[str, float]               # target -> least distance to the boundary of its sensor's view
    hand_overs: int = 0                     # targets that changed their sensor
    alone: int = 0                          # instants at which a target had no sensor, summed over targets
    merged: int = 0                         # detections merged from the readings of several sensors


def make_pursuer(sensor: Sensor, *, v_max_mps: float, sigma_m: float, step_ns: int, window: int,
                 rho_m: float) -> Pursuer:
    """Return a pursuer for `sensor`; `sigma_m` is that of the worst sensor of the team.

    The worst sensor's readings reach all filters, so escape areas have to allow for them: with each sensor's own sigma,
    3 of 600 targets escaped."""
    estimator = CircleFilter(window, rho_m=rho_m, v_max_mps=v_max_mps, sigma_m=sigma_m)
    return adaptive_pursuer(estimator, sensor.zones, sensor.law, v_max_mps=v_max_mps, sigma_m=sigma_m,
                            step_ns=step_ns, rho_m=rho_m)


def team(sensors: Mapping[str, Sensor], targets: Mapping[str, Evader], make: Making, rng: np.random.Generator,
         choices: Random, *, instants: int, step_ns: int) -> Outcome:
    """Run one game of `instants` steps; it changes `sensors`, which hold its state."""
    center = FusionCenter(choices)
    found = Outcome(dict.fromkeys(targets, inf))
    for k in range(instants):
        now_ns = k * step_ns
        entered = {name: _see(name, sensor, targets, center, rng, now_ns, first=k == 0)
                   for name, sensor in sensors.items()}
        claimed: set[str] = set()               # targets claimed at this instant, which no other sensor may claim
        for name, sensor in sensors.items():
            _claim(name, sensor, sensors, entered[name] - claimed, center, make, now_ns, found)
            claimed |= {target for target in entered[name] if center.in_charge_of(target) == name}
        for name, sensor in sensors.items():
            _decide(name, sensor, center, now_ns, found)
        found.alone += sum(center.in_charge_of(target) is None for target in targets)
        for _ in range(PARTS if k + 1 < instants else 0):
            _move(sensors, targets, center, step_ns * 1e-9 / PARTS, found)
    return found


def _see(name: str, sensor: Sensor, targets: Mapping[str, Evader], center: FusionCenter, rng: np.random.Generator,
         now_ns: int, first: bool) -> set[str]:
    """Report what the sensor detects now; return the targets that, for an idle sensor, have entered."""
    in_view = {target for target, evader in targets.items()
               if sensor.zones.distance_m(sensor.own, evader.place) >= 0}
    new = in_view - sensor.in_view
    entered = {target for target in new if first or sensor.zones.may_escape(sensor.own, targets[target].place)}
    sensor.in_view = in_view
    if sensor.pursuer is not None:
        if now_ns != sensor.look_ns:
            return set()
        sensor.looks += 1
        sensor.pursuer.asked(now_ns)
    for target in sorted(in_view if sensor.pursuer is not None else entered):
        x, y = targets[target].place
        dx, dy = sensor.sigma_m * rng.standard_normal(2)
        center.report(now_ns, Reading(name, target, now_ns, (x + float(dx), y + float(dy)), sensor.sigma_m))
    return entered if sensor.pursuer is None else set()


def _claim(name: str, sensor: Sensor, sensors: Mapping[str, Sensor], entered: set[str], center: FusionCenter,
           make: Making, now_ns: int, found: Outcome) -> None:
    before = {target: center.in_charge_of(target) for target in entered}
    target = center.claim(name, entered)
    if target is None:
        return
    former = before[target]
    if former is not None:
        sensors[former].pursuer = sensors[former].goal = None
        found.hand_overs += 1
    sensor.pursuer = make(sensor)
    sensor.pursuer.asked(now_ns)
    sensor.looks += 1


def _decide(name: str, sensor: Sensor, center: FusionCenter, now_ns: int, found: Outcome) -> None:
    if sensor.pursuer is None:
        return
    for detection in center.pass_on(name):
        found.merged += len(detection.sensors) > 1
        sensor.pursuer.detected(now_ns, detection.seen_ns, detection.place, sensor.own)
    decision: Decision = sensor.pursuer.step(now_ns, sensor.own)
    sensor.look_ns, sensor.goal = decision.look_ns, decision.goal


def _move(sensors: Mapping[str, Sensor], targets: Mapping[str, Evader], center: FusionCenter, dt_s: float,
          found: Outcome) -> None:
    for sensor in sensors.values():
        if sensor.goal is not None:
            sensor.own = sensor.law.moved(sensor.own, sensor.goal, dt_s)
    for target, evader in targets.items():
        in_charge = center.in_charge_of(target)
        hunter = sensors[in_charge] if in_charge is not None else None
        evader.moved(dt_s, hunter.own if hunter is not None else evader.place)
        if hunter is not None:
            found.least_m[target] = min(found.least_m[target], hunter.zones.distance_m(hunter.own, evader.place))
