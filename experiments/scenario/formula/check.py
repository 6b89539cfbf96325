"""Checks a formula against what is known of a run: names, units, and intervals that the run is long enough for.

Before the run the units of most signals are unknown, as nodes declare their signals when they start. An unknown unit
matches every other one; the same check is repeated when all nodes have declared theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Final

from experiments.scenario.formula.parse import FormulaError, parse, source
from experiments.scenario.formula.quantity import NO_DIMENSION, TIME, Dimension, of_signal, symbol_of, times, unit_of
from experiments.scenario.formula.syntax import (
    Absolute,
    Age,
    Always,
    Arithmetic,
    Comparison,
    Cost,
    Count,
    Counter,
    Events,
    Eventually,
    Extreme,
    Formula,
    Interval,
    Not,
    Number,
    Signal,
    Until,
    Value,
)
from experiments.scenario.model import Link
from experiments.scenario.problems import near
from netem.core.fate import Fate

OFFERED: Final = "offered"
NOT_DELIVERED: Final = "not delivered"
FATES: Final = (*(fate.value for fate in Fate), OFFERED, NOT_DELIVERED)
NS_PER_S: Final = 1e9

Units = Callable[[Signal], Collection[str] | None]
CostUnit = Callable[[Cost], str | None]


@dataclass(frozen=True)
class Known:
    """The names that a formula may use.

    `signals` maps each node to the units of its signals, None while they are unknown; `costs` each cost to its unit and
    the nodes that it has a part for. `links` resolves a selector and raises ValueError if there is no such link.
    """

    signals: Mapping[str, Mapping[str, str] | None]
    links: Callable[[str], Sequence[tuple[str, ...]]]
    length_ns: int
    costs: Mapping[str, tuple[str, Collection[str]]] = field(default_factory=dict)

    def units(self, signal: Signal) -> Collection[str] | None:
        found = [self.signals[node] for node in matching(signal.node, self.signals)]
        units = [each[signal.name] for each in found if each is not None and signal.name in each]
        return None if not units or None in found else units

    def unit_of_cost(self, cost: Cost) -> str | None:
        return self.costs[cost.name][0] if cost.name in self.costs else None


def check(text: str, known: Known, *, at_end: bool = True) -> list[FormulaError]:
    """Return every mistake in a formula, in the order of the text.

    `at_end` tells that it is judged after the run, when counters and costs are known.
    """
    try:
        formula = parse(text)
    except FormulaError as error:
        return [error]
    found: list[FormulaError] = []

    def wrong(rule: str, at: int) -> None:
        found.append(FormulaError(rule, text, at))

    for value in _terms(formula):
        if not at_end and isinstance(value, Counter | Cost):
            wrong("is known when the run has ended; write the formula in [expect]", value.start)
            continue
        _check_names(value, known, wrong)
    measured = Measured(text, known.units, known.unit_of_cost, wrong)
    for comparison in comparisons(formula):
        measured.comparison(comparison)
    if not found and horizon_ns(formula) > known.length_ns:
        _check_length(formula, known.length_ns, wrong)
    return sorted(found, key=lambda error: error.at)


def links_of(text: str, known: Known) -> dict[str, tuple[Link, ...]]:
    """Return the links of each selector in a formula without mistakes."""
    return {value.on: tuple((medium, sender, receiver) for medium, sender, receiver in known.links(value.on))
            for value in _terms(parse(text)) if isinstance(value, Age | Count)}


def horizon_ns(formula: Formula) -> int:
    """Return how far beyond an instant the records must reach for the formula to be judged there."""
    match formula:
        case Comparison():
            return 0
        case Not():
            return horizon_ns(formula.of)
        case Always() | Eventually():
            return _reach_ns(formula.interval) + horizon_ns(formula.of)
    ahead_ns = max(horizon_ns(formula.left), horizon_ns(formula.right))
    return ahead_ns + (_reach_ns(formula.interval) if isinstance(formula, Until) else 0)


def comparisons(formula: Formula) -> Iterator[Comparison]:
    match formula:
        case Comparison():
            yield formula
        case Not() | Always() | Eventually():
            yield from comparisons(formula.of)
        case _:
            yield from comparisons(formula.left)
            yield from comparisons(formula.right)


def unit_of_comparison(comparison: Comparison, text: str, units: Units, unit_of_cost: CostUnit) -> str:
    """Return the unit in which the sides of a comparison are judged, "" for plain numbers; FormulaError."""
    def wrong(rule: str, at: int) -> None:
        raise FormulaError(rule, text, at)

    return symbol_of(Measured(text, units, unit_of_cost, wrong).comparison(comparison) or NO_DIMENSION)


class Measured:
    """Determines the dimension of each value, None if it is unknown, and reports values that do not go together."""

    def __init__(self, text: str, units: Units, unit_of_cost: CostUnit, wrong: Callable[[str, int], None]) -> None:
        self.text = text
        self.units = units
        self.unit_of_cost = unit_of_cost
        self.wrong = wrong

    def comparison(self, part: Comparison) -> Dimension | None:
        return self._same(part.left, part.right)

    def _same(self, left: Value, right: Value) -> Dimension | None:
        one, other = self.of(left), self.of(right)
        if one is not None and other is not None and one != other:
            words = " and ".join(f"{source(value, self.text)} is {_in_words(dimension)}"
                                 for value, dimension in ((left, one), (right, other)))
            remedy = ""
            if isinstance(right, Number) and other == NO_DIMENSION:
                remedy = f"; write {source(right, self.text)} {symbol_of(one)}"
            self.wrong(f"units do not match: {words}{remedy}", right.start)
        return other if one is None else one

    def of(self, value: Value) -> Dimension | None:
        match value:
            case Number():
                return None if value.value == 0 and not value.dimension else value.dimension
            case Signal():
                return self._of_signal(value)
            case Age():
                return TIME
            case Cost():
                unit = self.unit_of_cost(value)
                return None if unit is None else unit_of(unit)[1] if unit else NO_DIMENSION
            case Count() | Events() | Counter():
                return NO_DIMENSION
            case Absolute():
                return self.of(value.of)
            case Extreme():
                same = [self._same(value.of[0], each) for each in value.of]
                return next((dimension for dimension in same if dimension is not None), None)
            case Arithmetic(operator="+" | "-"):
                return self._same(value.left, value.right)
        one, other = self.of(value.left), self.of(value.right)
        if slopes(value.right) and (value.operator == "/" or slopes(value.left)):
            self.wrong("an age and a cost change at every instant: they can be multiplied by numbers and signals and "
                       "divided by them, not by each other", value.right.start)
        if one is None or other is None:
            return None
        return times(one, other, -1 if value.operator == "/" else 1)

    def _of_signal(self, value: Signal) -> Dimension | None:
        units = self.units(value)
        dimensions = {of_signal(unit)[1] for unit in units or ()}
        if len(dimensions) > 1:
            self.wrong(f"the signals that match have different units: {', '.join(sorted(set(units or ())))}",
                       value.start)
        return dimensions.pop() if len(dimensions) == 1 else None


def slopes(value: Value) -> bool:
    """Return whether a value changes between the instants on record."""
    match value:
        case Age() | Cost():
            return True
        case Absolute():
            return slopes(value.of)
        case Extreme():
            return any(map(slopes, value.of))
        case Arithmetic():
            return slopes(value.left) or slopes(value.right)
    return False


def matching(pattern: str, names: Collection[str]) -> list[str]:
    return [name for name in names if fnmatchcase(name, pattern)]


def is_pattern(node: str) -> bool:
    return any(character in node for character in "*?[")


def _in_words(dimension: Dimension) -> str:
    return f"in {symbol_of(dimension)}" if dimension else "a plain number"


def _reach_ns(interval: Interval) -> int:
    return interval.from_ns if interval.to_ns is None else interval.to_ns


def _check_length(formula: Formula, length_ns: int, wrong: Callable[[str, int], None]) -> None:
    """Report the innermost interval with which a formula looks beyond the end of the run."""
    operands = [formula.of] if isinstance(formula, Not | Always | Eventually) else (
        [] if isinstance(formula, Comparison) else [formula.left, formula.right])
    inside = [operand for operand in operands if horizon_ns(operand) > length_ns]
    if inside:
        _check_length(inside[0], length_ns, wrong)
    elif isinstance(formula, Always | Eventually | Until):
        wrong(f"looks {horizon_ns(formula) / NS_PER_S:g} s ahead, beyond the run of {length_ns / NS_PER_S:g} s",
              formula.interval.start)


def _terms(formula: Formula) -> Iterator[Value]:
    for comparison in comparisons(formula):
        for side in (comparison.left, comparison.right):
            yield from values_in(side)


def values_in(value: Value, *, several: bool = False) -> Iterator[Value]:
    """Yield a value and the values in it; a pattern that is no argument of min or max is no `Signal`, but `_Alone`."""
    if isinstance(value, Signal) and is_pattern(value.node) and not several:
        yield _Alone(value.start, value.end, value.node, value.name)
        return
    yield value
    match value:
        case Absolute():
            yield from values_in(value.of)
        case Extreme():
            for each in value.of:
                yield from values_in(each, several=True)
        case Arithmetic():
            yield from values_in(value.left)
            yield from values_in(value.right)


class _Alone(Signal):
    """A pattern of signals where one value is needed."""


def _check_names(value: Value, known: Known, wrong: Callable[[str, int], None]) -> None:
    match value:
        case _Alone():
            wrong(f"a pattern names several signals: write max({value.node}.{value.name}) or "
                  f"min({value.node}.{value.name})", value.start)
        case Signal():
            _check_signal(value, known, wrong)
        case Events() | Counter() if not matching(value.node, known.signals):
            wrong(f"no node matches {value.node!r}; {near(value.node, known.signals)}", value.start)
        case Cost():
            _check_cost(value, known, wrong)
        case Age() | Count():
            if isinstance(value, Count) and value.fate not in FATES:
                wrong(f"there is no fate {value.fate!r}; {near(value.fate, FATES)}", value.start)
            try:
                known.links(value.on)
            except ValueError as error:
                wrong(str(error), value.start)


def _check_signal(value: Signal, known: Known, wrong: Callable[[str, int], None]) -> None:
    nodes = matching(value.node, known.signals)
    if not nodes:
        wrong(f"no node matches {value.node!r}; {near(value.node, known.signals)}", value.start)
        return
    declared = [known.signals[node] for node in nodes]
    names = [name for each in declared if each is not None for name in each]
    if None not in declared and value.name not in names:
        wrong(f"{value.node} has no signal {value.name!r}; {near(value.name, dict.fromkeys(names))}", value.start)


def _check_cost(value: Cost, known: Known, wrong: Callable[[str, int], None]) -> None:
    if value.name not in known.costs:
        wrong(f"there is no cost {value.name!r}; {near(value.name, known.costs)}; a cost is a table [costs.NAME]",
              value.start)
    elif value.node and value.node not in known.costs[value.name][1]:
        wrong(f"costs.{value.name} has no part for {value.node!r}; {near(value.node, known.costs[value.name][1])}",
              value.start)
