"""Parses the text of a formula with lark (LALR, grammar in `formula.lark`)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction
from functools import cache, lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final

from experiments.scenario.formula.quantity import NO_DIMENSION, TIME, Dimension, unit_of
from experiments.scenario.formula.syntax import (
    Absolute,
    Age,
    Always,
    And,
    Arithmetic,
    Comparison,
    Cost,
    Count,
    Counter,
    Events,
    Eventually,
    Extreme,
    Formula,
    Implies,
    Interval,
    Not,
    Number,
    Or,
    Signal,
    Until,
)
from netem.core.nearest import nearest
from netem.wire.instants import NS_PER

if TYPE_CHECKING:                       # a scenario without formulas does not import the parser
    from lark import Lark, Token

WORDS: Final = ("always", "eventually", "until", "implies", "and", "or", "not", "abs", "min", "max", "age", "count",
                "events", "counter", "cost")
WHOLE: Final = Interval(0, 0, 0, None)
_OPERATORS: Final[Mapping[str, Any]] = {"plus": "+", "minus": "-", "times": "*", "over": "/"}
_SAME: Final[Mapping[str, Any]] = {      # rules whose parts are the fields of the class
    "absolute": Absolute, "negation": Not, "conjunction": And, "disjunction": Or, "implies": Implies}
# A misspelt word after a number is read as its unit: `2 andd`.
_NO_UNIT: Final = re.compile(r"(?<![\w.])[\d.]+\s*([A-Za-z%]+)\s*$")
_LARGEST: Final = 200                   # exponent of ten
DEEPEST: Final = 100
KEPT: Final = 256                       # formulas whose syntax trees are kept: a sweep parses each text once


class FormulaError(ValueError):
    """A formula that cannot be judged; `at` is the offset of the mistake in `text`."""

    def __init__(self, rule: str, text: str, at: int) -> None:
        self.rule = rule
        self.text = text
        self.at = at
        super().__init__(self.pointed())

    def pointed(self) -> str:
        """Return the rule, the line of the formula, and a caret below the mistake."""
        before = self.text[:self.at]
        line = self.text.split("\n")[before.count("\n")]
        if not line.strip():
            return self.rule
        column = len(before) - (before.rfind("\n") + 1)
        return f"column {column + 1}: {self.rule}\n    {line}\n    {' ' * column}^"


@lru_cache(KEPT)
def parse(text: str) -> Formula:
    """Return the syntax tree; raises FormulaError for text that is no formula, an unknown unit or an empty interval."""
    from lark.exceptions import UnexpectedInput

    try:
        tree: Formula = _Builder(text).build(_parser().parse(text))
    except UnexpectedInput as error:
        raise _syntax_error(text, error) from None
    return tree


def source(part: Any, text: str) -> str:
    """Return the text of a part on one line."""
    return " ".join(text[part.start:part.end].split())


@cache
def _parser() -> Lark:
    from lark import Lark

    grammar = files("experiments.scenario.formula").joinpath("formula.lark").read_text("utf-8")
    return Lark(grammar, parser="lalr", propagate_positions=True, maybe_placeholders=True)


def _syntax_error(text: str, error: Any) -> FormulaError:
    token = getattr(error, "token", None)
    at = len(text.rstrip()) if token is not None and token.type == "$END" else error.pos_in_stream
    allowed = next((found for name in ("accepts", "expected", "allowed") if (found := getattr(error, name, None))), ())
    expected = {terminal.removeprefix("_") for terminal in allowed}
    if (taken := _NO_UNIT.search(text[:at])) and not _is_unit(taken[1]):
        guess = nearest(taken[1], WORDS, 0.7)
        return FormulaError(f"{taken[1]!r} is no unit" + (f"; did you mean {guess}?" if guess else ""), text,
                            taken.start(1))
    rest = text[at:]
    word = ""
    for character in rest:
        if not (character.isalnum() or character in "_.*?"):
            break
        word += character
    rule = f"expected {_in_words(expected)}"
    if not text.strip():
        rule = "is empty; write a formula such as \"always(r1.y < 2)\""
    elif (guess := nearest(word, WORDS, 0.7)) and guess != word:
        rule += f"; did you mean {guess}?"
    elif "SIGNAL" in expected and word and "." not in word:
        rule += f'; a signal is written {word}.NAME'
    return FormulaError(rule, text, at)


_VALUE: Final = {"NUMBER", "SIGNAL", "ABS", "MIN", "MAX", "AGE", "COUNT", "EVENTS", "COUNTER", "COST", "MINUS", "LPAR"}
_MEANING: Final[Mapping[str, set[str]]] = {     # what each set of terminals is called in an error, larger sets first
    "a formula": {*_VALUE, "ALWAYS", "EVENTUALLY", "NOT"}, "a number, a signal or a function": _VALUE,
    "and, or, implies, until": {"AND", "OR", "IMPLIES", "UNTIL"}, "and, or, implies": {"AND", "OR", "IMPLIES"},
    "a comparison such as <": {"COMPARATOR"},
    "+, -, *, /": {"PLUS", "MINUS", "STAR", "SLASH"}, "+, -": {"PLUS", "MINUS"}, "a unit": {"UNIT"},
    '"medium: sender -> receiver"': {"LINK"}, "a fate": {"FATE"}, "the name of a cost": {"COST_NAME"},
    "a number": {"NUMBER"}, '"node.name"': {"SIGNAL"}, "end": {"END"}, "(": {"LPAR"}, ")": {"RPAR"}, "[": {"LSQB"},
    "]": {"RSQB"}, "a comma": {"COMMA"}, "the end of the formula": {"$END"}}


def _is_unit(text: str) -> bool:
    try:
        unit_of(text)
    except ValueError:
        return False
    return True


def _in_words(expected: set[str]) -> str:
    left, said = set(expected), []
    for words, terminals in _MEANING.items():
        if terminals <= left:
            said.append(words)
            left -= terminals
    return " or ".join([*said, *sorted(left)])


class _Builder:
    """Turns lark's tree into the syntax tree; `text` is the formula."""

    def __init__(self, text: str) -> None:
        self.text = text

    def build(self, tree: Any, depth: int = 0) -> Any:
        """Return the part for a rule of the grammar; tokens stay as they are."""
        if not hasattr(tree, "children"):
            return tree
        start, end = tree.meta.start_pos, tree.meta.end_pos
        if depth > DEEPEST:
            raise FormulaError(f"nested too deeply: at most {DEEPEST} operations within each other", self.text, start)
        parts = [self.build(child, depth + 1) for child in tree.children]
        rule = str(tree.data)
        if rule in _OPERATORS:
            return Arithmetic(start, end, _OPERATORS[rule], *parts)
        if rule in _SAME:
            return _SAME[rule](start, end, *parts)
        match rule:
            case "number":
                value, dimension = self._quantity(*parts)
                return Number(start, end, float(value), dimension)
            case "signal" | "events" | "counter":
                node, _, name = str(parts[0]).strip("'").partition(".")
                return {"signal": Signal, "events": Events, "counter": Counter}[rule](start, end, node, name)
            case "age":
                return Age(start, end, _one_line(parts[0]))
            case "count":
                return Count(start, end, _one_line(parts[0]), _one_line(parts[1]))
            case "cost":
                name, _, node = str(parts[0]).partition(".")
                return Cost(start, end, name, node)
            case "negative":
                return Arithmetic(start, end, "*", Number(start, start + 1, -1.0, NO_DIMENSION), parts[0])
            case "smallest" | "largest":
                return Extreme(start, end, "min" if rule == "smallest" else "max", tuple(parts))
            case "comparison":
                left, operator, right = parts
                return Comparison(start, end, str(operator), left, right)  # type: ignore[arg-type]
            case "always" | "eventually":
                return {"always": Always, "eventually": Eventually}[rule](start, end, parts[0] or WHOLE, parts[1])
            case "until":
                left, interval, right = parts
                return Until(start, end, left, right, interval or WHOLE)
            case "bound":
                return start, *parts
            case "interval":
                return self._interval(start, end, *parts)
        raise AssertionError(f"{rule}: a rule of the grammar without a class")

    def _interval(self, start: int, end: int, first: Any, last: Any) -> Interval:
        """`first` and `last` are (place, number, unit or None); `last` may be the word `end`."""
        at, number, unit = first
        if not isinstance(last, tuple):
            return Interval(start, end, self._ns(at, number, unit), None)
        from_ns, to_ns = self._ns(at, number, unit or last[2]), self._ns(last[0], last[1], last[2] or unit)
        if to_ns < from_ns:
            raise FormulaError("an empty interval; expected [start, end] with start <= end", self.text, start)
        return Interval(start, end, from_ns, to_ns)

    def _ns(self, at: int, number: Token, unit: Token | None) -> int:
        value, dimension = self._quantity(number, unit)
        if dimension != TIME and (value or dimension):
            raise FormulaError(f"an interval is in time; write for example {number} s", self.text, at)
        return round(value * NS_PER["s"])

    def _quantity(self, number: Token, unit: Token | None) -> tuple[Fraction, Dimension]:
        scale, dimension = Fraction(1), NO_DIMENSION
        if unit is not None:
            try:
                scale, dimension = unit_of(str(unit))
            except ValueError as error:
                raise FormulaError(str(error), self.text, unit.start_pos or 0) from None
        decimal = Decimal(str(number))
        if decimal.adjusted() > _LARGEST or decimal.adjusted() < -_LARGEST:
            raise FormulaError(f"expected a number below 1e{_LARGEST}", self.text, number.start_pos or 0)
        return Fraction(decimal) * scale, dimension


def _one_line(token: Token) -> str:
    return " ".join(str(token).split())
