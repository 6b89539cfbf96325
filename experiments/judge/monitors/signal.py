"""A signal of a node stays within bounds, or one that is worked out after the run.

Not modelled: what a signal does between two samples. What must not be missed, a program tells at the instant at which
it happens: see `reported`.
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
        return self.judge((Reports(node, name, table.time_ns, table.column(name)) for node, name, table in tables
                           if name in table.names), records.length_ns)
