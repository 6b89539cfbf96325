"""No escape: a target is in the view of at least one observer at every instant of the run.

    d(t)      the largest over the observers of the true distance from the target to the boundary of its field of view
    violated  while d < 0

The true distance is known at the sample instants t_k. The bound v = `closing_speed_mps` on the rate of d also bounds it
in between:

    on [t_k, t_k+1)     d >= (d_k + d_k+1 - v (t_k+1 - t_k)) / 2,       and v must not be exceeded by the samples

Without it only the sample instants are judged; d then counts from one until the next.
Source: dissertation, section 3.2.3 (the no-escape theorem), with signed distances.
Not modelled: obstacles, whose shadows count as in view; an observer that does not request looks.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from math import isfinite
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from experiments.judge.groups import Ints, new_group
from experiments.judge.monitors.escape_cause import cause
from experiments.judge.monitors.outcome import Finding, Violation
from experiments.judge.monitors.records import Records
from experiments.judge.monitors.view_boundary import distance_m
from experiments.scenario.subjects import Named, Subject

Floats = NDArray[np.float64]
ROUNDING_M = 1e-9


@dataclass(frozen=True)
class InView:
    ON: ClassVar = Named.SIGHTS
    UNIT: ClassVar = "m"

    closing_speed_mps: float | None = None      # of target and observer together; with turning sectors the sweep too

    def __post_init__(self) -> None:
        speed = self.closing_speed_mps
        if speed is not None and not (isfinite(speed) and speed > 0):
            raise ValueError(f"closing_speed_mps={speed}: expected more than 0")

    def requires(self) -> str:
        if self.closing_speed_mps is None:
            return "in view at every sample"
        return f"in view at every instant, at up to {self.closing_speed_mps:g} m/s towards the boundary"

    def watch(self, subjects: Sequence[Subject], records: Records) -> Finding:
        violations: list[Violation] = []
        least: list[float] = []
        for target in dict.fromkeys(target for _, target, _ in subjects):
            observers = [subject for subject in subjects if subject[1] == target]
            time_ns, distances = _distances(observers, records)
            if not time_ns.size:
                return Finding(judged=False)
            low = self._least(time_ns, distances, records.length_ns)
            least.append(float(low.min()))
            violations += self._outside(observers, time_ns, distances, low, records)
            violations += self._too_fast(target, time_ns, distances, records.length_ns)
        return Finding(violations, min(least), min(least)) if least else Finding(judged=False)

    def _least(self, time_ns: Ints, distances: Floats, length_ns: int) -> Floats:
        """Return the smallest distance [m] possible between each sample and the next, or the end."""
        if self.closing_speed_mps is None:
            return distances
        ways_m = self.closing_speed_mps * np.diff(np.r_[time_ns, length_ns]) * 1e-9
        following = np.r_[distances[1:], distances[-1] - ways_m[-1]]
        between = (distances + following - ways_m) / 2
        least: Floats = np.minimum(np.minimum(distances, following), between)
        return least

    def _outside(self, observers: Sequence[Subject], time_ns: Ints, distances: Floats, low: Floats,
                 records: Records) -> Iterator[Violation]:
        for start, end in _rows(low < 0):
            from_ns = int(time_ns[start])
            until_ns = int(time_ns[end]) if end < time_ns.size else records.length_ns
            central_ns = _last_central(observers, time_ns[:start + 1], distances[:start + 1], records)
            yield Violation(_on(observers), observers[0][1], from_ns, until_ns, float(low[start:end].min()),
                            cause(observers, records, central_ns, from_ns))

    def _too_fast(self, target: str, time_ns: Ints, distances: Floats, length_ns: int) -> Iterator[Violation]:
        if self.closing_speed_mps is None:
            return
        gaps_s = np.diff(time_ns) * 1e-9
        changes_m = np.abs(np.diff(distances))
        for start, end in _rows(changes_m > self.closing_speed_mps * gaps_s + ROUNDING_M):
            fastest = float((changes_m[start:end] / gaps_s[start:end]).max())
            yield Violation(target, target, int(time_ns[start]), min(int(time_ns[end]), length_ns), None,
                            f"its distance to the boundary changes by up to {fastest:.4g} m/s, so that nothing is "
                            f"known between samples; state what closing_speed_mps really can be")


def _distances(observers: Sequence[Subject], records: Records) -> tuple[Ints, Floats]:
    """Return the sample instants that all bodies share, and the largest distance over the observers at each."""
    found = []
    for medium, target, observer in observers:
        poses, eye = records.sights[medium].poses(), records.camera(medium, observer)
        there = _place(target, poses[target].outputs, records)
        still = np.zeros(there[0].size)
        camera = ((there[0], still, still, still) if eye.carrier is None else
                  _place(eye.carrier, poses[eye.carrier].outputs, records))
        found.append((eye.view, camera, there))
    time_ns: Ints = reduce(np.intersect1d, [place[0] for _, camera, there in found for place in (camera, there)])
    time_ns = time_ns[time_ns < records.length_ns]
    if not time_ns.size:
        return time_ns, np.zeros(0)
    each = []
    for view, camera, there in found:
        (x, y, heading), (to_x, to_y, _) = _at(time_ns, camera), _at(time_ns, there)
        each.append(distance_m(view, (x, y, heading), (to_x, to_y)))
    largest: Floats = np.max(each, axis=0)
    return time_ns, largest


def _at(time_ns: Ints, place: tuple[Ints, Floats, Floats, Floats]) -> tuple[Floats, Floats, Floats]:
    rows = np.searchsorted(place[0], time_ns)
    return place[1][rows], place[2][rows], place[3][rows]


def _place(node: str, outputs: Sequence[str], records: Records) -> tuple[Ints, Floats, Floats, Floats]:
    """Return the sample instants [ns], x [m], y [m] and heading [rad] of a body."""
    table = records.signals.get(node)
    if table is None or any(name not in table.names for name in outputs):
        return np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0), np.zeros(0)
    return table.time_ns, table.column(outputs[0]), table.column(outputs[1]), table.column(outputs[-1])


def _last_central(observers: Sequence[Subject], time_ns: Ints, distances: Floats, records: Records) -> int:
    """Return the last instant at which the target was inside by more than half of the largest range, or the start."""
    half_m = max(records.camera(medium, observer).view.range_m for medium, _, observer in observers) / 2
    central = np.flatnonzero(distances >= half_m)
    return int(time_ns[central[-1]]) if central.size else 0


def _rows(true: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield [start, end) of each run of true values."""
    starts = np.flatnonzero(new_group(true.astype(np.int64))).tolist()
    for start, end in pairwise([*starts, true.size]):
        if true[start]:
            yield start, end


def _on(observers: Sequence[Subject]) -> str:
    return f"{observers[0][1]} in view of {' or '.join(observer for _, _, observer in observers)}"
