"""The values that a formula compares, as functions of time, from the records of a run.

    node.signal     held from each sample to the next; before the first sample, the first value
    age(link)       rises by 1 s/s and falls at deliveries; of several links the largest (see `link_metrics`)
    count(...)      frame copies with a fate, counted when each copy ends
    events(...)     events of a kind, counted at their instants
    counter(...)    the value at the end of the run, at every instant: no record has it earlier
    cost(NAME)      what a cost has come to so far

All values are in SI units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from experiments.judge.costs import NotAccrued
from experiments.judge.costs.accrued import accrued, parts_of
from experiments.judge.formula import curve as curves
from experiments.judge.formula.curve import Curve
from experiments.judge.link_metrics import sawtooth
from experiments.judge.monitors.link_frames import rows_of
from experiments.judge.run_data import RunData
from experiments.judge.run_files import LEDGER
from experiments.scenario.formula.check import NOT_DELIVERED, OFFERED, is_pattern, values_in
from experiments.scenario.formula.parse import FormulaError, source
from experiments.scenario.formula.quantity import of_signal
from experiments.scenario.formula.syntax import (
    Absolute,
    Age,
    Comparison,
    Cost,
    Count,
    Counter,
    Events,
    Extreme,
    Number,
    Signal,
    Value,
)
from experiments.scenario.metric_keys import matching, uncounted
from experiments.scenario.problems import near
from netem.core import link_selector
from netem.records.signal_table import SignalTable

NS_PER_S = 1e9
Link = tuple[str, str, str]


class NotMeasured(Exception):
    """The run has no records of a value that a formula compares; the message has the reason."""


class Terms:
    """Computes the values of a formula for one run; the value of a term is computed once."""

    def __init__(self, data: RunData, formula: str, links: Mapping[str, Sequence[Link]]) -> None:
        self.data = data
        self.formula = formula
        self.length_ns = data.length_ns
        self._links = links
        self._known: dict[str, Curve] = {}
        self._members: dict[str, list[tuple[str, Curve]]] = {}      # links or signals of each value that has several

    def value(self, value: Value) -> Curve:
        """Return a value over the run; raises NotMeasured, or FormulaError for a name that the run does not know."""
        text = self.formula[value.start:value.end]
        if text not in self._known:
            self._known[text] = self._value(value)
        return self._known[text]

    def subjects(self, comparison: Comparison, at_ns: float, below: bool) -> tuple[str, ...]:
        """Return, of each value that stands for several links or signals, the one that counts at an instant.

        `below` means the limit from below.
        """
        found: dict[str, None] = {}
        for side in (comparison.left, comparison.right):
            for value in values_in(side):
                members = self._members.get(self.formula[value.start:value.end], ())
                if len(members) > 1:
                    least = isinstance(value, Extreme) and value.which == "min"
                    each = [curves.value(curve, at_ns, below) for _, curve in members]
                    found[members[each.index(min(each) if least else max(each))][0]] = None
        return tuple(found)

    def units(self, signal: Signal) -> list[str]:
        """Return the units of the signals that match."""
        return [table.units[table.names.index(signal.name)] for table in self._tables(signal)]

    def unit_of_cost(self, cost: Cost) -> str:
        known = self.data.scenario.get("costs") or {}
        if cost.name not in known:
            raise FormulaError(f"the run has no cost {cost.name!r}; {near(cost.name, known)}", self.formula, cost.start)
        return str(known[cost.name]["unit"])

    def _value(self, value: Value) -> Curve:
        end = float(self.length_ns)
        match value:
            case Number():
                return curves.constant(value.value, end)
            case Signal():
                return self._signals(value)[0][1]
            case Age():
                return self._age(value)
            case Count():
                return self._counted(self._ends(value))
            case Events():
                nodes = set(matching(value.node, self.data.nodes))
                return self._counted(np.array([event.time_ns for event in self.data.events if event.kind == value.kind
                                               and event.node in nodes], dtype=np.int64))
            case Counter():
                return curves.constant(self._counter(value), end)
            case Cost():
                return self._cost(value)
            case Absolute():
                return curves.absolute(self.value(value.of))
            case Extreme():
                members = []
                for part in value.of:
                    members += self._signals(part) if isinstance(part, Signal) else [
                        (source(part, self.formula), self.value(part))]
                self._members[self.formula[value.start:value.end]] = members
                found = [each for _, each in members]
                return curves.largest(found) if value.which == "max" else -curves.largest([-each for each in found])
        one, other = self.value(value.left), self.value(value.right)
        match value.operator:
            case "+":
                return curves.plus(one, other)
            case "-":
                return curves.plus(one, -other)
            case "*":
                return curves.times(one, other)
        return curves.over(one, other)

    def _tables(self, signal: Signal) -> list[SignalTable]:
        nodes = matching(signal.node, self.data.signals)
        found = [self.data.signals[node] for node in nodes if signal.name in self.data.signals[node].names]
        if not found:
            known = dict.fromkeys(f"{node}.{name}" for node, table in self.data.signals.items() for name in table.names)
            wanted = f"{signal.node}.{signal.name}"
            raise FormulaError(f"the run has no signal {wanted}; {near(wanted, known)}", self.formula, signal.start)
        return found

    def _signals(self, signal: Signal) -> list[tuple[str, Curve]]:
        found = []
        for table in self._tables(signal):
            name = f"{table.node}.{signal.name}"
            time_ns, values = table.sampled(signal.name)
            if not time_ns.size or time_ns[0] >= max(self.length_ns, 1):
                raise NotMeasured(f"{name} was never sampled")
            unknown = np.flatnonzero(np.isnan(values) & (time_ns < self.length_ns))
            if unknown.size:
                raise NotMeasured(f"{name} is not a number at {time_ns[unknown[0]] / NS_PER_S:g} s")
            scale = of_signal(table.units[table.names.index(signal.name)])[0]
            scaled = values * scale if scale != 1 else values
            found.append((name, curves.steps(time_ns, scaled, float(self.length_ns))))
        return found

    def _age(self, age: Age) -> Curve:
        links = self._links_of(age.on, age.start)
        link, from_ns, to_ns, newest_ns = sawtooth(links, self.data.ledger, self.length_ns)
        starts = np.searchsorted(link, np.arange(len(links) + 1))
        members = []
        for (medium, sender, receiver), low, high in zip(links, starts[:-1].tolist(), starts[1:].tolist(), strict=True):
            lasts = np.flatnonzero(to_ns[low:high] > from_ns[low:high]) + low
            if lasts.size:
                t = np.r_[from_ns[lasts], to_ns[lasts[-1]]].astype(np.float64)
                members.append((f"{medium}: {sender} -> {receiver}", Curve(
                    t, (from_ns - newest_ns)[lasts] / NS_PER_S, (to_ns - newest_ns)[lasts] / NS_PER_S)))
        self._members[self.formula[age.start:age.end]] = members
        found = [each for _, each in members]
        return curves.largest(found) if found else curves.constant(0.0, float(self.length_ns))

    def _ends(self, count: Count) -> NDArray[np.int64]:
        """Return the instants at which the copies of a fate ended."""
        _, rows = rows_of(self.data.ledger.link, self._links_of(count.on, count.start))
        copies = self.data.ledger.taken(rows)
        if count.fate == OFFERED:
            return copies.ints("offered_ns")
        wanted = ~copies.delivered if count.fate == NOT_DELIVERED else copies.fate.among(count.fate)
        copies = copies.taken(wanted)
        delivered_ns, end_ns = copies.ints("delivered_ns"), copies.ints("end_ns")
        ended_ns = np.where(end_ns >= 0, end_ns, copies.ints("offered_ns"))
        return np.where(delivered_ns >= 0, delivered_ns, ended_ns)

    def _counted(self, at: NDArray[np.int64]) -> Curve:
        """Return the number of instants up to each instant."""
        at = np.sort(np.maximum(at, 0))
        return curves.steps(np.r_[np.int64(-1), at], np.arange(at.size + 1, dtype=np.float64), float(self.length_ns))

    def _counter(self, counter: Counter) -> float:
        found = [counters[counter.counter] for node, counters in self.data.counters.items()
                 if counter.counter in counters and node in matching(counter.node, self.data.counters)]
        if not found:
            raise NotMeasured(uncounted(f"count.{counter.node}.{counter.counter}", self.data.counters)
                              or f"no node has a counter {counter.counter!r}")
        return float(sum(found))

    def _cost(self, cost: Cost) -> Curve:
        self.unit_of_cost(cost)
        if cost.node and cost.node not in (known := parts_of(self.data)[cost.name]):
            raise FormulaError(f"costs.{cost.name} has no part for {cost.node!r}; {near(cost.node, known)}",
                               self.formula, cost.start)
        try:
            return accrued(cost.name, cost.node, self.data)
        except NotAccrued as error:
            raise NotMeasured(f"costs.{cost.name}: {error}") from None

    def _links_of(self, on: str, at: int) -> Sequence[Link]:
        """Return the links of a selector: those of the scenario, else those in the ledger that match."""
        if any(line.startswith(LEDGER) for line in self.data.missing):
            raise NotMeasured("nothing is known about frames")
        if on in self._links:
            return [(medium, sender, receiver) for medium, sender, receiver in self._links[on]]
        there = self.data.ledger.link.names
        nodes_on: dict[str, dict[str, None]] = {}
        for medium, sender, receiver in there:
            nodes_on.setdefault(medium, {}).update({sender: None, receiver: None})
        for name, medium in (self.data.scenario.get("media") or {}).items():
            nodes_on.setdefault(name, {}).update(dict.fromkeys(medium["nodes"]))
        themselves = {name: [one for medium, one, other in there if medium == name and one == other]
                      for name in nodes_on}
        try:
            links = link_selector.parse(on).resolve({name: list(nodes) for name, nodes in nodes_on.items()}, themselves)
        except ValueError as error:
            raise FormulaError(str(error), self.formula, at) from None
        found = [link for link in links if link in set(there)]
        return found if is_pattern(on) and found else links
