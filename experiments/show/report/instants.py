"""Finds the instant that shows a broken expectation best: that of an extreme value, or of the first frame of its kind.

An expectation is judged over the whole run or a part of it. A mean, most counters, or an event that never occurred have
no such instant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.judge.frame_copies import Ints, Mask
from experiments.judge.run_data import RunData
from experiments.judge.run_result import Verdict
from experiments.scenario.fate_keys import FATE_OF
from experiments.scenario.metric_keys import CountKey, GuaranteeKey, LedgerKey, SignalKey, matching, parse

Floats = NDArray[np.float64]
Window = tuple[int, int]                # [start_ns, end_ns)
PLACE_OF: dict[str, tuple[Callable[[Floats], int], str]] = {
    "first": (lambda values: 0, "the first sample"),
    "last": (lambda values: values.size - 1, "the last sample"),
    "last_abs": (lambda values: values.size - 1, "the last sample"),
    "spread_last": (lambda values: values.size - 1, "the last sample"),
    "min": (lambda values: int(values.argmin()), "the smallest value"),
    "max": (lambda values: int(values.argmax()), "the largest value"),
    "abs_max": (lambda values: int(np.abs(values).argmax()), "the value furthest from 0"),
}


class Instant(NamedTuple):
    time_ns: int
    words: str              # description: "r3.y: the largest value"


def instant_of(verdict: Verdict, window: Window | None, data: RunData) -> Instant | None:
    """Return the instant of an expectation that does not hold, None without one.

    `window` is the part of the run that the expectation judges; None: all of it.
    """
    if verdict.at_ns is not None:
        return Instant(verdict.at_ns, ", on ".join(filter(None, (verdict.predicate, verdict.subject))))
    match parse(verdict.key):
        case SignalKey() as wanted:
            return _of_signal(wanted, verdict, window or (0, 2**63 - 1), data)
        case LedgerKey(metric, medium) if len(data.ledger):
            return _Frames(data, medium, window).instant(metric)
        case CountKey(pattern, counter):
            nodes = set(matching(pattern, data.nodes))
            return next((Instant(event.time_ns, f"{event.node}: {event.kind}, for the first time")
                         for event in data.events if event.kind == counter and event.node in nodes), None)
        case GuaranteeKey(name) if name in data.guarantees and (first := data.guarantees[name].standing.first):
            return Instant(first.from_ns, "the first violation")
    return None


def _of_signal(wanted: SignalKey, verdict: Verdict, window: Window, data: RunData) -> Instant | None:
    """Return the instant of the statistic at the node whose value is nearest to the verdict's."""
    if wanted.statistic not in PLACE_OF:
        return None
    place, words = PLACE_OF[wanted.statistic]
    found: list[tuple[float, Instant]] = []
    for node in matching(wanted.nodes, data.signals):
        table = data.signals[node]
        if wanted.signal not in table.names:
            continue
        first, end = np.searchsorted(table.time_ns, window)
        values = table.column(wanted.signal)[first:end]
        if values.size == 0 or np.isnan(values).all():
            continue
        at = place(np.nan_to_num(values))
        value = abs(values[at]) if wanted.statistic in ("last_abs", "abs_max") else values[at]
        off = abs(value - verdict.value) if verdict.value is not None else 0.0
        found.append((float(off), Instant(int(table.time_ns[first + at]), f"{node}.{wanted.signal}: {words}")))
    return min(found, default=(0.0, None), key=lambda entry: entry[0])[1]


class _Frames:
    """Finds instants among the copies that were judged, in the order of the ledger."""

    def __init__(self, data: RunData, medium: str | None, window: Window | None) -> None:
        self.length_ns = data.length_ns
        self.copies = data.ledger if medium is None else data.ledger.taken(data.ledger.end_of(medium=medium))
        if window is not None:
            offered_ns = self.copies.ints("offered_ns")
            self.copies = self.copies.taken((offered_ns >= window[0]) & (offered_ns < window[1]))

    def instant(self, metric: str) -> Instant | None:
        if metric in FATE_OF:
            return self._first(self.copies.fate.among(FATE_OF[metric].value))
        match metric:
            case "delivery_ratio" | "frames_not_delivered":
                return self._first(~self.copies.delivered)
            case "age_of_information_max_s" | "age_of_information_mean_s":
                return _greatest(self._ages())
            case "max_successive_losses":
                return _greatest(self._losses())
            case "inter_transmission_min_s":
                return _greatest(self._gaps(-1, "shortest"))
            case "inter_transmission_max_s":
                return _greatest(self._gaps(1, "longest"))
        return None

    def _first(self, chosen: Mask) -> Instant | None:
        rows = np.flatnonzero(chosen)
        if not rows.size:
            return None
        offered_ns = self.copies.ints("offered_ns")
        row = int(rows[offered_ns[rows].argmin()])
        fate = self.copies.fate.names[self.copies.fate.codes[row]]
        return Instant(int(offered_ns[row]), f"{self._link(row)}: the first copy {fate}")

    def _link(self, row: int) -> str:
        medium, sender, receiver = self.copies.link.names[self.copies.link.codes[row]]
        return f"{medium}: {sender} -> {receiver}"

    def _by_link(self, order: str) -> list[Ints]:
        """Return the rows of each link, sorted by the column `order`."""
        link = self.copies.link.codes
        rows = np.lexsort((self.copies.ints(order), link))
        return np.split(rows, np.flatnonzero(np.diff(link[rows].astype(np.int64))) + 1) if rows.size else []

    def _ages(self) -> Iterator[tuple[int, Instant]]:
        """Yield each link's largest age with the instant of the delivery that ends it, or the end of the run."""
        delivered = self.copies.delivered
        for rows in self._by_link("delivered_ns"):
            got = rows[delivered[rows]]
            newest = np.maximum.accumulate(np.append(0, self.copies.ints("offered_ns")[got]))
            ends = np.append(self.copies.ints("delivered_ns")[got], self.length_ns)
            at = int((ends - newest).argmax())
            yield int(ends[at] - newest[at]), Instant(int(ends[at]),
                                                      f"{self._link(int(rows[0]))}: the largest age ends")

    def _losses(self) -> Iterator[tuple[int, Instant]]:
        """Yield each link's longest row of frames lost, with the first one's instant."""
        delivered = self.copies.delivered
        for rows in self._by_link("number"):
            numbers, first = np.unique(self.copies.ints("number")[rows], return_index=True)
            arrived = np.logical_or.reduceat(delivered[rows], first)
            bounds = np.concatenate([[-1], np.flatnonzero(arrived), [numbers.size]])
            lost = np.diff(bounds) - 1
            at = int(lost.argmax())
            if lost[at]:
                row = int(rows[first[bounds[at] + 1]])
                yield int(lost[at]), Instant(int(self.copies.ints("offered_ns")[row]),
                                             f"{self._link(row)}: {lost[at]} frames in a row are lost from here on")

    def _gaps(self, sign: int, words: str) -> Iterator[tuple[int, Instant]]:
        """Yield each link's greatest time between transmissions, times `sign`, with the instant of its end."""
        on_air_ns = self.copies.ints("on_air_ns")
        for rows in self._by_link("number"):
            rows = rows[on_air_ns[rows] >= 0]
            starts = np.unique(on_air_ns[rows])
            if starts.size > 1:
                gaps = np.diff(starts) * sign
                at = int(gaps.argmax())
                sender = self._link(int(rows[0])).partition(" -> ")[0]
                yield int(gaps[at]), Instant(int(starts[at + 1]),
                                             f"{sender}: the {words} time between transmissions ends")


def _greatest(found: Iterable[tuple[int, Instant]]) -> Instant | None:
    return max(found, default=(0, None), key=lambda scored: scored[0])[1]
