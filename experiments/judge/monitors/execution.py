"""The recorded execution of each program is one of the hybrid automaton that the program declares.

Source: the dissertation, Definitions 1 to 3; the rules are those of `agents.hybrid.checker`. A change of mode that
names another node as its cause needs a frame or a sight of that node, delivered at most `contact_within_s` earlier.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from experiments.judge.executions import refusals
from experiments.judge.monitors.outcome import Finding, Violation
from experiments.judge.monitors.records import Records
from experiments.scenario.subjects import Named, Subject
from netem.wire.instants import NEVER_NS


@dataclass(frozen=True)
class Execution:
    ON: ClassVar = Named.EXECUTIONS
    UNIT: ClassVar = ""

    contact_within_ns: int | None = None        # None: at any time before

    def __post_init__(self) -> None:
        if self.contact_within_ns is not None and self.contact_within_ns < 1:
            raise ValueError(f"contact_within_ns={self.contact_within_ns}: expected at least 1")

    def requires(self) -> str:
        within = "" if self.contact_within_ns is None else f" within {self.contact_within_ns * 1e-9:g} s"
        return f"an execution of the declared automaton, each outside cause heard or seen{within}"

    def watch(self, subjects: Sequence[Subject], records: Records) -> Finding:
        automata = {node: records.automata[node] for (node,) in subjects}
        found = refusals(automata, records.events, records.ledger, records.signals, records.showing,
                         NEVER_NS if self.contact_within_ns is None else self.contact_within_ns)
        return Finding([Violation(refusal.node, refusal.node, refusal.from_ns, max(refusal.from_ns, refusal.until_ns),
                                  None, f"{refusal.rule.value}: {refusal.what}") for refusal in found])
