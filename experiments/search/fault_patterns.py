"""Faults that a search draws: kind, target, instant, duration, and the fields of the kind itself.

Two faults that take a node away, as `kill` and `pause` do, must not overlap on it; `compatible` leaves the later out.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from math import floor, log10
from random import Random
from typing import Any

from experiments.scenario.model import FaultSpec
from experiments.scenario.toml_text import toml_text
from experiments.search.budget import BadBudget, Budget
from netem.faults import Fault, Site
from netem.faults.candidates import Candidate
from netem.faults.schedule import Occurrence
from netem.faults.table import FAULTS

Span = tuple[str, int, int]             # a node, and [start_ns, end_ns) during which it is away


@dataclass(frozen=True)
class DrawnFault:
    """One fault at one instant. `fields` are those of its kind; `lasts_ns` is None for a kind without an end."""

    kind: str
    on: str
    at_ns: int
    lasts_ns: int | None
    fields: dict[str, Any] = field(default_factory=dict)
    candidate: Candidate = field(default=Candidate(""), repr=False, compare=False)     # of which it was drawn

    def table(self) -> dict[str, Any]:
        """Return the entry of `[[faults]]`, with times in seconds."""
        times = {"at_ns": self.at_ns} | ({} if self.lasts_ns is None else {"lasts_ns": self.lasts_ns})
        return {"kind": self.kind, "on": self.on} | _in_seconds(times | self.fields)

    def in_words(self) -> str:
        fields = ", ".join(f"{key} = {toml_text(value)}" for key, value in _in_seconds(self.fields).items())
        return f"{self.kind} of {self.on}{f' ({fields})' if fields else ''} at {self.at_ns / 1e9:.9g} s"

    def away(self) -> Span | None:
        fault: Fault = FAULTS[self.kind](**self.fields)
        if not fault.away:
            return None
        end_ns = self.at_ns if self.lasts_ns is None else self.at_ns + self.lasts_ns
        return self.on, self.at_ns, fault.until_ns(Occurrence(self.at_ns, end_ns))


class FaultSpace:
    """The faults that a search may choose from, in a run of `length_ns`; `most` is their number."""

    def __init__(self, budget: Budget, site: Site, length_ns: int, planned: Sequence[FaultSpec]) -> None:
        self.most = budget.faults
        self._length_ns = length_ns
        self._taken = [(node, *span) for spec in planned if spec.settings.away for node, *_ in spec.targets
                       for span in _spans(spec)]
        found = {kind: FAULTS[kind].candidates(site) for kind in budget.kinds or FAULTS} if budget.faults else {}
        for kind in budget.kinds:
            if not found[kind]:
                raise BadBudget(f"--budget faults of {kind}: nothing in the scenario takes one: it needs "
                                f"{FAULTS[kind].needs}; leave this kind out")
        self._kinds = {kind: candidates for kind, candidates in found.items() if candidates}
        self._grid_ns = max(1, 10 ** (floor(log10(length_ns)) - 3))     # instants that a reader can read

    @property
    def choices(self) -> list[tuple[str, Candidate]]:
        """Every kind with each of its candidates: the first candidate of each kind, the second ones, and so on."""
        turns = zip_longest(*([(kind, candidate) for candidate in candidates]
                              for kind, candidates in self._kinds.items()))
        return [choice for turn in turns for choice in turn if choice is not None]

    @property
    def empty(self) -> bool:
        return not self._kinds

    def draw(self, rng: Random, choice: tuple[str, Candidate] | None = None) -> DrawnFault:
        """Draw a kind, a candidate of it, its fields, an instant and a duration."""
        if choice is None:
            kinds = list(self._kinds)
            kind = kinds[int(rng.random() * len(kinds))]
            choice = kind, self._kinds[kind][int(rng.random() * len(self._kinds[kind]))]
        kind, candidate = choice
        fields = self._fields(candidate, rng)
        at_ns = self._rounded(rng.random() * self._length_ns)
        lasts_ns = self._rounded((0.01 + 0.24 * rng.random()) * self._length_ns) if FAULTS[kind].lasting else None
        return DrawnFault(kind, candidate.on, min(at_ns, self._length_ns - 1),
                          None if lasts_ns is None else max(1, lasts_ns), fields, candidate)

    def randomly(self, rng: Random) -> tuple[DrawnFault, ...]:
        if self.empty:
            return ()
        return self.compatible(self.draw(rng) for _ in range(1 + int(rng.random() * self.most)))

    def mutated(self, faults: Sequence[DrawnFault], rng: Random) -> tuple[DrawnFault, ...]:
        """Return the faults with one moved, replaced, left out or added."""
        if self.empty:
            return ()
        found, choice = list(faults), rng.random()
        if not found or (choice < 0.2 and len(found) < self.most):
            return self.compatible([*found, self.draw(rng)])
        place = int(rng.random() * len(found))
        if choice < 0.3 and len(found) > 1:
            del found[place]
        elif choice < 0.4:
            found[place] = self.draw(rng)
        elif choice < 0.5:      # the same fault, its fields drawn anew
            found[place] = replace(found[place], fields=self._fields(found[place].candidate, rng))
        else:                   # a move by up to a tenth of the run, small moves being as likely as large ones
            far = self._length_ns / 10 * 10 ** (-3 * rng.random())
            at_ns = found[place].at_ns + (far if rng.random() < 0.5 else -far)
            found[place] = replace(found[place], at_ns=min(max(self._rounded(at_ns), 0), self._length_ns - 1))
        return self.compatible(found)

    def compatible(self, faults: Iterable[DrawnFault]) -> tuple[DrawnFault, ...]:
        """Return the first `most` faults in order of time, without those that would overlap."""
        kept: list[DrawnFault] = []
        taken = list(self._taken)
        for fault in sorted(list(faults)[:self.most], key=lambda one: (one.at_ns, one.kind, one.on)):
            span = fault.away()
            if span is not None:
                if any(span[0] == node and span[1] < end_ns and start_ns < span[2] for node, start_ns, end_ns in taken):
                    continue
                taken.append(span)
            kept.append(fault)
        return tuple(kept)

    def _fields(self, candidate: Candidate, rng: Random) -> dict[str, Any]:
        return {key: (self._rounded(value) or value) if key.endswith("_ns") else value
                for key, value in candidate.draw(rng, self._length_ns).items()}

    def _rounded(self, time_ns: float) -> int:
        return int(round(time_ns / self._grid_ns) * self._grid_ns)


def _spans(spec: FaultSpec) -> list[tuple[int, int]]:
    if spec.at_random:          # may meet others, and has no effect then
        return []
    return [(start_ns, spec.settings.until_ns(Occurrence(start_ns, end_ns))) for start_ns, end_ns in spec.occurrences]


def _in_seconds(fields: dict[str, Any]) -> dict[str, Any]:
    return {f"{key.removesuffix('_ns')}_s" if key.endswith("_ns") else key:
            value / 1e9 if key.endswith("_ns") else list(value) if isinstance(value, tuple) else value
            for key, value in fields.items()}
