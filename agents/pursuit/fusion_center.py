"""Merges the readings of several sensors, and puts sensors in charge of targets (Figure 3.3, section 3.2).

    report      takes a sensor's reading; all readings of one instant are merged to their mean, weighted by 1 / sigma^2
    claim       puts an idle sensor in charge of one target, at random, of those that entered; its former sensor is idle
    pass_on     returns the detections that the sensor in charge has not got yet; a new one gets all that are kept

A sensor is in charge of at most one target, and a target has at most one sensor. An instant is closed once its mean
was passed on: a later reading of it is rejected, since filters have applied the mean already. A late reading of an
older instant that has no other reading is passed on; filters order it by its time stamp.

Differs from the dissertation, which does not say how readings of one instant are merged or when a sensor lets go.
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
    sensors: frozenset[str]     # sensors whose readings were merged


@dataclass
class _Target:
    open: dict[int, list[Reading]] = field(default_factory=dict)
    closed: list[tuple[int, Detection]] = field(default_factory=list)      # (number, detection), numbers ascend
    number: int = 0                                                         # number of the detection closed last
    told: int = 0                                                           # last number passed to the one in charge


class FusionCenter:
    """Invariant: no two sensors in `_followed` have the same target."""

    def __init__(self, rng: Random, keep: int = 17) -> None:
        """`rng` chooses among targets that enter together; `keep`: detections kept per target, Gamma of the filters."""
        if keep < 1:
            raise ValueError(f"keep={keep}: expected 1 or more")
        self._rng = rng
        self._keep = keep
        self._targets: dict[str, _Target] = {}
        self._followed: dict[str, str] = {}         # sensor -> its target

    def target_of(self, sensor: str) -> str | None:
        return self._followed.get(sensor)

    def in_charge_of(self, target: str) -> str | None:
        return next((sensor for sensor, followed in self._followed.items() if followed == target), None)

    def report(self, now_ns: int, reading: Reading) -> bool:
        """Add a reading; returns False if its instant is closed.

        Raises ValueError for a place or sigma that is no number, a time stamp after now, or a repeated reading."""
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
        if len(target.open) > self._keep:           # no sensor is in charge of the target
            del target.open[min(target.open)]
        return True

    def claim(self, sensor: str, entered: Collection[str]) -> str | None:
        """Return the target that the sensor is in charge of from now on; None if it had one already or none entered."""
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
        """Make the sensor idle."""
        self._followed.pop(sensor, None)

    def pass_on(self, sensor: str, with_own: bool = True) -> list[Detection]:
        """Close the open instants of the sensor's target; return its detections not passed on yet, in order of time.

        `with_own=False` leaves out detections with a reading of the sensor itself, which it has applied already.
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
    """Return the mean place of (place, sigma) pairs, weighted by 1 / sigma^2; of readings or of predictions."""
    weights = [1 / sigma ** 2 for _, sigma in places]
    total = sum(weights)
    return (sum(weight * place[0] for weight, (place, _) in zip(weights, places, strict=True)) / total,
            sum(weight * place[1] for weight, (place, _) in zip(weights, places, strict=True)) / total)
