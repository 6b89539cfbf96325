"""Bounds on a signal of a node, or on one that is computed after the run.

Not modelled: the course of a signal between two samples. For a value that must not be missed, a program reports it at
the instant of its change: see `reported`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from experiments.judge.monitors.outcome import Finding
from experiments.judge.monitors.records import Records
from experiments.judge.monitors.value_bounds import Reports, ValueBounds
from experiments.scenario.subjects import Named, Subject


@dataclass(frozen=True)
class Signal(ValueBounds):
    ON: ClassVar = Named.SIGNALS

    def watch(self, subjects: Sequence[Subject], records: Records) -> Finding:
        tables = [(node, name, records.signals[node]) for node, name in subjects if node in records.signals]
        return self.judge((Reports(node, name, *table.sampled(name)) for node, name, table in tables
                           if name in table.names), records.length_ns)
