"""The robustness of a run with respect to a formula of signal temporal logic, with the instant that decides it.

    rho(x < c) = c - x          rho(not f) = -rho(f)        rho(f and g) = min      rho(f or g) = max
    rho(always[a, b] f, t) = inf over [t + a, t + b]        eventually: sup         until: see `curve.until`
    rho(f implies g) = rho(not f or g)                      rho of the run = rho at t = 0

Positive: the run satisfies the formula, and no change of the compared values by less than rho breaks it; negative: the
run violates it. At 0 the Boolean semantics decide, by which 3 <= 3 holds and 3 < 3 does not.

Sources: A. Donzé, O. Maler 2010 (robust satisfaction over real-valued signals); G. Fainekos, G. Pappas 2009.
Differs from Donzé, Maler 2010: `until` does not ask its left side to hold at the instant at which the right one does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from experiments.judge.formula import curve as curves
from experiments.judge.formula.curve import Curve, NotThatLong
from experiments.judge.formula.terms import NotMeasured, Terms
from experiments.judge.run_data import RunData
from experiments.scenario.formula.check import horizon_ns, unit_of_comparison
from experiments.scenario.formula.parse import FormulaError, parse, source
from experiments.scenario.formula.syntax import (
    Always,
    And,
    Comparison,
    Eventually,
    Formula,
    Implies,
    Not,
    Or,
    Until,
)

__all__ = ["FormulaError", "NotMeasured", "OverTime", "Robustness", "over_time", "robustness"]

NS_PER_S: Final = 1e9
Link = tuple[str, str, str]


@dataclass(frozen=True)
class Robustness:
    """`value` is in `unit`, that of the predicate that decides; `time_s` is the instant at which it does."""

    value: float
    time_s: float
    predicate: str                  # as written: "abs(r2.error) < 0.1 m"
    unit: str                       # "" for a plain number
    satisfied: bool
    subjects: tuple[str, ...] = ()  # of each value over several links or signals, the one that counts there


@dataclass(frozen=True)
class _Judged:
    """A part of the formula with its robustness over time, and those of its operands."""

    part: Formula
    curve: Curve
    operands: Sequence[_Judged] = ()


def robustness(data: RunData, formula: str, links: Mapping[str, Sequence[Link]] | None = None) -> Robustness:
    """Return the robustness of `formula` at t = 0, computed from the arrays in `data`; no folder is read.

    `links` has the links of each selector in the formula; without them they are those of the ledger. Raises
    FormulaError for text that is no formula, or units that do not match those of the signals, and NotMeasured if the
    run has nothing to judge it by.
    """
    part = parse(formula)
    terms = Terms(data, formula, links or {})
    judged = _judge(part, terms, _distance)
    found = curves.value(judged.curve, 0.0)
    if not np.isfinite(found):
        raise NotMeasured("it divides by 0 at some instant")
    satisfied = found > 0
    if found == 0:
        satisfied = curves.value(_judge(part, terms, _sign).curve, 0.0) > 0
    predicate, at_ns, below = _deciding(judged, 0.0, False)
    return Robustness(found, at_ns / NS_PER_S, source(predicate, formula),
                      unit_of_comparison(predicate, formula, terms.units, terms.unit_of_cost), satisfied,
                      terms.subjects(predicate, at_ns, below))


class OverTime:
    """The robustness as a function of the instant at which a formula is judged."""

    def __init__(self, formula: str, judged: _Judged) -> None:
        self.curve = judged.curve
        self._formula = formula
        self._judged = judged

    def decided(self, at_ns: float, below: bool = False) -> tuple[str, float]:
        """Return the comparison that decides the robustness at an instant, and when it does [ns].

        `below` means the limit from below.
        """
        predicate, decided_ns, _ = _deciding(self._judged, at_ns, below)
        return source(predicate, self._formula), decided_ns


def over_time(data: RunData, formula: str, links: Mapping[str, Sequence[Link]] | None = None) -> OverTime:
    """Return the robustness at each instant at which the records reach far enough; raises as `robustness`."""
    judged = _judge(parse(formula), Terms(data, formula, links or {}), _distance)
    if not np.isfinite(judged.curve.first).all() or not np.isfinite(judged.curve.last).all():
        raise NotMeasured("it divides by 0 at some instant")
    return OverTime(formula, judged)


def _judge(part: Formula, terms: Terms, predicate: Callable[[Comparison, Curve], Curve]) -> _Judged:
    try:
        return _judged(part, terms, predicate)
    except NotThatLong:
        needed_s, length_s = horizon_ns(part) / NS_PER_S, terms.length_ns / NS_PER_S
        raise NotMeasured(f"it looks {needed_s:g} s ahead, and the run ended at {length_s:g} s") from None


def _judged(part: Formula, terms: Terms, predicate: Callable[[Comparison, Curve], Curve]) -> _Judged:
    match part:
        case Comparison():
            left, right = terms.value(part.left), terms.value(part.right)
            difference = curves.plus(left, -right) if part.operator in (">", ">=") else curves.plus(right, -left)
            return _Judged(part, predicate(part, difference))
        case Not():
            operand = _judged(part.of, terms, predicate)
            return _Judged(part, -operand.curve, [operand])
        case Always() | Eventually():
            operand = _judged(part.of, terms, predicate)
            window = curves.inf if isinstance(part, Always) else curves.sup
            return _Judged(part, window(operand.curve, part.interval.from_ns, part.interval.to_ns), [operand])
    one, other = _judged(part.left, terms, predicate), _judged(part.right, terms, predicate)
    match part:
        case And():
            curve = curves.smaller(one.curve, other.curve)
        case Or():
            curve = curves.larger(one.curve, other.curve)
        case Implies():
            curve = curves.larger(-one.curve, other.curve)
        case Until():
            curve = curves.until(one.curve, other.curve, part.interval.from_ns, part.interval.to_ns)
    return _Judged(part, curve, [one, other])


def _distance(part: Comparison, difference: Curve) -> Curve:
    """Return the robustness of a comparison: how far its sides are on the right side of each other."""
    match part.operator:
        case "==":
            return -curves.absolute(difference)
        case "!=":
            return curves.absolute(difference)
    return difference


def _sign(part: Comparison, difference: Curve) -> Curve:
    """Return 1 where a comparison holds and -1 where it does not, on each piece that does not change its sign."""
    split = curves.split_at_zero(_distance(part, difference))
    middle = split.first + split.last
    at_zero = 1.0 if part.operator in ("<=", ">=", "==") else -1.0
    signs = np.where(middle == 0, at_zero, np.sign(middle))
    return Curve(split.t, signs, signs)


def _deciding(judged: _Judged, at: float, below: bool) -> tuple[Comparison, float, bool]:
    """Return the comparison whose value at an instant is that of the formula at `at`; the earliest such instant.

    `below`, also of what is returned, means the limit from below, as for the peak of an age before a frame arrives.
    """
    part = judged.part
    match part:
        case Comparison():
            return part, at, below
        case Not():
            return _deciding(judged.operands[0], at, below)
        case Always() | Eventually():
            operand = judged.operands[0]
            end = operand.curve.end if part.interval.to_ns is None else at + part.interval.to_ns
            seen = curves.extremes(operand.curve, at + part.interval.from_ns, min(end, operand.curve.end), below)
            k = int(seen.values.argmin() if isinstance(part, Always) else seen.values.argmax())
            return _deciding(operand, float(seen.at[k]), bool(seen.below[k]))
        case Until():
            return _deciding_until(judged, part, at, below)
    one, other = judged.operands
    values = curves.value(one.curve, at, below), curves.value(other.curve, at, below)
    left = {And: values[0] <= values[1], Or: values[0] >= values[1], Implies: -values[0] >= values[1]}[type(part)]
    return _deciding(one if left else other, at, below)


def _deciding_until(judged: _Judged, part: Until, at: float, below: bool) -> tuple[Comparison, float, bool]:
    """Return the instant at which the right side is reached best, or the earlier one at which the left side is worst.

    At each candidate instant the left side counts up to the one before it; both are split at their crossings.
    """
    one, other = judged.operands
    hold, reach = curves.split_at_crossings(one.curve, other.curve)
    from_ns, to_ns = part.interval.from_ns, part.interval.to_ns
    end = hold.end if to_ns is None else min(hold.end, at + to_ns)
    held, reached = curves.extremes(hold, at, end, below), curves.extremes(reach, at, end, below)
    so_far = np.minimum.accumulate(held.values)
    before = np.where(held.below, so_far, np.r_[np.inf, so_far[:-1]])   # a limit from below has the left side with it
    must = float(curves.extremes(hold, at, at + from_ns, below).values.min()) if from_ns else np.inf
    worth = np.minimum(np.minimum(reached.values, before), must)
    opens = at + from_ns
    allowed = (reached.at > opens) | (reached.at == opens) & (below | ~reached.below)
    k = int(np.where(allowed, worth, -np.inf).argmax())
    if reached.values[k] <= min(before[k], must):
        return _deciding(other, float(reached.at[k]), bool(reached.below[k]))
    until = max(float(reached.at[k]), at + from_ns)
    inside = curves.extremes(hold, at, until, below)
    counts = (inside.at < until) | inside.below | (must < before[k])
    m = int(np.where(counts, inside.values, np.inf).argmin())
    return _deciding(one, float(inside.at[m]), bool(inside.below[m]))
