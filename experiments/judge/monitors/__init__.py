"""Guarantees that a scenario states, checked over the whole run: at every instant, not only at the end.

A member of this kind is a frozen dataclass whose fields are its keys in `[guarantees.NAME]`, with one verb, `watch`: it
goes through the records of a run and finds every interval in which the guarantee is violated. The key `on` names its
subjects, in one of the ways of `Named` (experiments/scenario/subjects.py).

Monitors read the ledger, the samples and the events after the run. Their instants are exact to the nanosecond and the
same on every host, and the emulator is not slowed down. Violations are added to the records as events.

docs/guarantees.md defines all kinds, with their limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, Protocol

from experiments.scenario.subjects import Named, Subject

if TYPE_CHECKING:                       # a command that only needs the names of the kinds imports no table library
    from experiments.judge.monitors.outcome import Finding
    from experiments.judge.monitors.records import Records


class Monitor(Protocol):
    ON: ClassVar[Named]
    UNIT: ClassVar[str]                 # suffix of worst and margin: "s", "m", or "" for numbers of frames and signals

    def requires(self) -> str:
        """The guarantee in words, with its bound."""

    def watch(self, subjects: Sequence[Subject], records: Records) -> Finding:
        """Return every violation on these subjects, the worst value, and its distance to the bound."""
