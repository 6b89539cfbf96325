"""What sensors tell each other of the targets, and who is in charge of which (Figure 3.3; section 3.2 on exchange).

    report      a sensor has seen a target: of one instant all readings are merged, their mean weighted by 1 / sigma^2
    claim       an idle sensor has seen targets enter: one of them, at random, is its own; who followed it is idle then
    pass_on     what the sensor in charge has not been told yet; to a new one all that is kept, so its filter can start

A sensor is in charge of one target at most, a target has one sensor at most. An instant is closed when it is passed on:
a reading of it that comes later is left out, since its mean is in filters already. One of an older instant that nobody
else saw is passed on like any other; filters take it by its time stamp.

Differs from the dissertation: it leaves open what several readings of one instant are and when a sensor lets go.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from math import isfinite
from random import Random
from typing import NamedTuple

from agents.pursuit import Place


class Reading(NamedTuple):
    sensor: str
    target: str
    seen_ns: int
    place: Place
    sigma_m: float


class Detection(NamedTuple):
    seen_ns: int
    place: Place
    sensors: frozenset[str]     # whose readings it was made from


@dataclass
class _Target:
    open: dict[int, list[Reading]] = field(default_factory=dict)
    closed: list[tuple[int, Detection]] = field(default_factory=list)      # with a number that only grows
    number: int = 0
    told: int = 0                                                           # up to which the one in charge was told


class FusionCenter:
    """Invariant: `_followed` has no target twice."""

    def __init__(self, rng: Random, keep: int = 17) -> None:
        """`rng` chooses among targets that enter together; `keep`: detections per target, Gamma of the filters."""
        if keep < 1:
            raise ValueError(f"keep={keep}: expected 1 or more")
        self._rng = rng
        self._keep = keep
        self._targets: dict[str, _Target] = {}
        self._followed: dict[str, str] = {}         # sensor: its target

    def target_of(self, sensor: str) -> str | None:
        return self._followed.get(sensor)

    def in_charge_of(self, target: str) -> str | None:
        return next((sensor for sensor, followed in self._followed.items() if followed == target), None)

    def report(self, now_ns: int, reading: Reading) -> bool:
        """Whether it counts. ValueError for one that is no place, from the future, or there already."""
        if not (isfinite(reading.place[0]) and isfinite(reading.place[1])):
            raise ValueError(f"{reading.sensor}: {reading.target} at {reading.place} m: expected finite numbers; leave "
                             f"it out")
        if not reading.sigma_m > 0:
            raise ValueError(f"{reading.sensor}: sigma_m={reading.sigma_m}: expected more than 0")
        if reading.seen_ns > now_ns:
            raise ValueError(f"{reading.sensor}: {reading.target} seen at {reading.seen_ns} ns, told at {now_ns} ns: "
                             f"it is from the future; synchronize the sensor's clock")
        target = self._targets.setdefault(reading.target, _Target())
        if any(detection.seen_ns == reading.seen_ns for _, detection in target.closed):
            return False
        if len(target.closed) == self._keep and reading.seen_ns < target.closed[0][1].seen_ns:
            return False
        readings = target.open.setdefault(reading.seen_ns, [])
        if any(other.sensor == reading.sensor for other in readings):
            raise ValueError(f"{reading.sensor}: {reading.target} seen at {reading.seen_ns} ns: it has told of this "
                             f"instant already; keep one of them")
        readings.append(reading)
        if len(target.open) > self._keep:           # nobody is in charge of it
            del target.open[min(target.open)]
        return True

    def claim(self, sensor: str, entered: Collection[str]) -> str | None:
        """The target that the sensor is in charge of from now on; None if it has one already or none entered."""
        if sensor in self._followed or not entered:
            return None
        target = self._rng.choice(sorted(entered))
        before = self.in_charge_of(target)
        if before is not None:
            del self._followed[before]
        self._followed[sensor] = target
        self._targets.setdefault(target, _Target()).told = 0
        return target

    def release(self, sensor: str) -> None:
        """The sensor is idle from now on."""
        self._followed.pop(sensor, None)

    def pass_on(self, sensor: str, with_own: bool = True) -> list[Detection]:
        """What the sensor has not been told of its target, in order of time; it closes the instants that are open.

        `with_own=False` leaves out instants at which it looked itself, for a sensor that uses its own at once.
        """
        if sensor not in self._followed:
            return []
        target = self._targets[self._followed[sensor]]
        for seen_ns, readings in sorted(target.open.items()):
            target.number += 1
            place = weighted_mean([(reading.place, reading.sigma_m) for reading in readings])
            target.closed.append((target.number, Detection(seen_ns, place,
                                                           frozenset(reading.sensor for reading in readings))))
        target.open.clear()
        target.closed.sort(key=lambda numbered: numbered[1].seen_ns)
        del target.closed[:-self._keep]
        news = [detection for number, detection in target.closed if number > target.told]
        target.told = target.number
        return [detection for detection in news if with_own or sensor not in detection.sensors]


def weighted_mean(places: Sequence[tuple[Place, float]]) -> Place:
    """Of (place, sigma) pairs: of readings of one instant, or of several filters' predictions for one."""
    weights = [1 / sigma ** 2 for _, sigma in places]
    total = sum(weights)
    return (sum(weight * place[0] for weight, (place, _) in zip(weights, places, strict=True)) / total,
            sum(weight * place[1] for weight, (place, _) in zip(weights, places, strict=True)) / total)
