"""The syntax tree of a formula. `start` and `end` are the place of a part in the text, [start, end).

    Formula = Comparison | Not | And | Or | Implies | Always | Eventually | Until      true or false at each instant
    Value   = Number | Arithmetic | Absolute | Extreme | Term                          a number at each instant
    Term    = Signal | Age | Count | Events | Counter | Cost                           a number from the records

Intervals are closed, [a, b] in ns from the present instant; b = None: up to the end of the run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from experiments.scenario.formula.quantity import Dimension


@dataclass(frozen=True)
class Part:
    start: int
    end: int


@dataclass(frozen=True)
class Number(Part):
    value: float                    # in SI units
    dimension: Dimension


@dataclass(frozen=True)
class Signal(Part):
    node: str                       # a pattern only as an argument of min or max
    name: str


@dataclass(frozen=True)
class Age(Part):
    """Age of information [s]; of several links, the largest."""

    on: str                         # "radio: r1 -> r2"


@dataclass(frozen=True)
class Count(Part):
    """Number of frame copies that have ended with this fate so far."""

    fate: str                       # name of a `Fate`, `OFFERED` or `NOT_DELIVERED`
    on: str


@dataclass(frozen=True)
class Events(Part):
    """Number of events of this kind so far."""

    node: str
    kind: str


@dataclass(frozen=True)
class Counter(Part):
    """Value of a counter at the end of the run, summed over nodes, at every instant."""

    node: str
    counter: str


@dataclass(frozen=True)
class Cost(Part):
    """Cost of `[costs.NAME]` so far, of one node if `node` is not ""."""

    name: str
    node: str


@dataclass(frozen=True)
class Arithmetic(Part):
    operator: Literal["+", "-", "*", "/"]
    left: Value
    right: Value


@dataclass(frozen=True)
class Absolute(Part):
    of: Value


@dataclass(frozen=True)
class Extreme(Part):
    which: Literal["min", "max"]
    of: tuple[Value, ...]


@dataclass(frozen=True)
class Comparison(Part):
    operator: Literal["<", "<=", ">", ">=", "==", "!="]
    left: Value
    right: Value


@dataclass(frozen=True)
class Not(Part):
    of: Formula


@dataclass(frozen=True)
class Both(Part):
    left: Formula
    right: Formula


@dataclass(frozen=True)
class And(Both):
    pass


@dataclass(frozen=True)
class Or(Both):
    pass


@dataclass(frozen=True)
class Implies(Both):
    pass


@dataclass(frozen=True)
class Interval(Part):
    from_ns: int
    to_ns: int | None


@dataclass(frozen=True)
class Always(Part):
    interval: Interval
    of: Formula


@dataclass(frozen=True)
class Eventually(Part):
    interval: Interval
    of: Formula


@dataclass(frozen=True)
class Until(Both):
    interval: Interval


Term = Signal | Age | Count | Events | Counter | Cost
Value = Number | Arithmetic | Absolute | Extreme | Term
Formula = Comparison | Not | And | Or | Implies | Always | Eventually | Until
