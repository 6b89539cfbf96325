"""Costs of a run that a scenario states: `[costs.NAME]`, each with the key `kind` and the fields of that kind's class.

A member of this kind is a frozen dataclass with one verb, `accrue`: what the cost has come to at each instant, as
piecewise linear functions of time, one for each of its parts. A part has the name of a node, or "" if there is only
one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar, Protocol

from experiments.scenario.subjects import Named

if TYPE_CHECKING:                       # `marconet check` computes no cost
    from experiments.judge.formula.curve import Curve
    from experiments.judge.run_data import RunData


class NotAccrued(Exception):
    """The run has no records to compute a cost from; the message has the reason."""


class Cost(Protocol):
    ON: ClassVar[Named]                 # what each of `subjects` is
    UNIT: ClassVar[str]                 # "J", or "" for a plain number

    @property
    def subjects(self) -> Sequence[str]:
        """The signals or senders that the cost is about, as written in the scenario."""

    def accrue(self, data: RunData) -> Mapping[str, Curve]:
        """Return the cost from the start of the run up to each instant, by part; raises NotAccrued."""
