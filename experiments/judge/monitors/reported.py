"""Bounds on a number that a program reports as it changes, so that no instant is missed, such as a small-gain product.

The program tells it by `node.event(kind, detail)`, where the detail begins with the number, whenever it changes.
Source of the use: dissertation, (4.37) and Remark 15: the loop is stable while gamma gamma_e(tau) < 1.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import nan
from typing import ClassVar, Final

import numpy as np

from experiments.judge.monitors.outcome import Finding
from experiments.judge.monitors.records import Records
from experiments.judge.monitors.value_bounds import Reports, ValueBounds
from experiments.scenario.metric_keys import nearest
from experiments.scenario.subjects import Named, Subject

NUMBER: Final = re.compile(r"\s*([-+]?(?:\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?|inf))(?![\w.])")


@dataclass(frozen=True)
class Reported(ValueBounds):
    ON: ClassVar = Named.EVENTS

    def watch(self, subjects: Sequence[Subject], records: Records) -> Finding:
        told: dict[Subject, list[tuple[int, str]]] = {subject: [] for subject in subjects}
        for event in sorted(records.events, key=lambda event: event.time_ns):
            if (event.node, event.kind) in told:
                told[event.node, event.kind].append((event.time_ns, event.detail))
        if not any(told.values()):
            return Finding(judged=False, why=_nothing_told(subjects, records))
        return self.judge((Reports(node, kind, np.array([time_ns for time_ns, _ in reports], dtype=np.int64),
                                   np.array([number_in(detail) for _, detail in reports], dtype=np.float64),
                                   [detail for _, detail in reports])
                           for (node, kind), reports in told.items()), records.length_ns)


def _nothing_told(subjects: Sequence[Subject], records: Records) -> str:
    nodes, kind = {node for node, _ in subjects}, subjects[0][1]
    near = nearest(kind, {event.kind for event in records.events if event.node in nodes})
    return f"no node that it names told an event {kind!r}" + (f"; nearest: {near!r}" if near else "")


def number_in(detail: str) -> float:
    """Return the number at the beginning of a text, nan if there is none."""
    found = NUMBER.match(detail)
    return float(found[1]) if found else nan
