"""Faults that a search draws: kind, target, instant, duration, and the fields of the kind itself.

Two faults that take a node away, as `kill` and `pause` do, must not overlap on it; `compatible` leaves the later out.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from math import floor, log10
from random import Random
from typing import Any

from experiments.scenario.model import FaultSpec
from experiments.search.budget import BadBudget, Budget
from netem.faults import Fault, Site
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

    def table(self) -> dict[str, Any]:
        """Return the entry of `[[faults]]`, with times in seconds."""
        times = {"at_ns": self.at_ns} | ({} if self.lasts_ns is None else {"lasts_ns": self.lasts_ns})
        return {"kind": self.kind, "on": self.on} | _in_seconds(times | self.fields)

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
        probe = Random(0)
        kinds = budget.kinds or tuple(FAULTS)
        if budget.faults:
            for kind in budget.kinds:
                if FAULTS[kind].draw(probe, length_ns) is None:
                    raise BadBudget(f"--budget faults of {kind}: a search cannot draw this kind; leave it out")
        drawn = [kind for kind in kinds if budget.faults and FAULTS[kind].draw(probe, length_ns) is not None]
        self.choices = [(kind, on) for kind in drawn for on in FAULTS[kind].targets(site)]
        self._grid_ns = max(1, 10 ** (floor(log10(length_ns)) - 3))     # instants that a reader can read

    def draw(self, rng: Random, choice: tuple[str, str] | None = None) -> DrawnFault:
        kind, on = choice or self.choices[int(rng.random() * len(self.choices))]
        cls = FAULTS[kind]
        fields = cls.draw(rng, self._length_ns) or {}
        at_ns = self._rounded(rng.random() * self._length_ns)
        lasts_ns = self._rounded((0.01 + 0.24 * rng.random()) * self._length_ns) if cls.lasting else None
        return DrawnFault(kind, on, min(at_ns, self._length_ns - 1), None if lasts_ns is None else max(1, lasts_ns),
                          {key: self._field(key, value) for key, value in fields.items()})

    def randomly(self, rng: Random) -> tuple[DrawnFault, ...]:
        if not self.choices:
            return ()
        return self.compatible(self.draw(rng) for _ in range(1 + int(rng.random() * self.most)))

    def mutated(self, faults: Sequence[DrawnFault], rng: Random) -> tuple[DrawnFault, ...]:
        """Return the faults with one moved, replaced, left out or added."""
        if not self.choices:
            return ()
        found, choice = list(faults), rng.random()
        if not found or (choice < 0.2 and len(found) < self.most):
            return self.compatible([*found, self.draw(rng)])
        place = int(rng.random() * len(found))
        if choice < 0.3 and len(found) > 1:
            del found[place]
        elif choice < 0.5:
            found[place] = self.draw(rng)
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

    def _rounded(self, time_ns: float) -> int:
        return int(round(time_ns / self._grid_ns) * self._grid_ns)

    def _field(self, key: str, value: Any) -> Any:
        return (self._rounded(value) or value) if key.endswith("_ns") and isinstance(value, int) else value


def _spans(spec: FaultSpec) -> list[tuple[int, int]]:
    if spec.at_random:          # may meet others, and has no effect then
        return []
    return [(start_ns, spec.settings.until_ns(Occurrence(start_ns, end_ns))) for start_ns, end_ns in spec.occurrences]


def _in_seconds(fields: dict[str, Any]) -> dict[str, Any]:
    return {f"{key.removesuffix('_ns')}_s" if key.endswith("_ns") else key:
            value / 1e9 if key.endswith("_ns") else value for key, value in fields.items()}
