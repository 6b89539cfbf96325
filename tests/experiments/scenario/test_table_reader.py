"""Values by their type hints, with pydantic as the oracle: it takes the same values, and they are equal."""

from __future__ import annotations

import enum
import json
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import pytest
from annotated_types import Ge, Gt, Interval, Len
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, TypeAdapter, ValidationError

from experiments.scenario.problems import Problems
from experiments.scenario.shape import Shape
from experiments.scenario.table_reader import TableReader
from netem.topology.table import TopologySettings


class Colour(enum.Enum):
    RED = "a"
    BLUE = "b"


@dataclass(frozen=True)
class Inner:
    width: float
    kind: Literal["a", "b"] = "a"

    def __post_init__(self) -> None:
        if self.width < 0:
            raise ValueError(f"width={self.width}: expected >= 0")


HINTS: list[Any] = [int, float, str, bool, int | None, Annotated[int, Ge(0)], Annotated[float, Gt(0.5)],
                    Annotated[int, Interval(ge=1, lt=4)], Annotated[list[int], Len(1, 2)], tuple[int, ...],
                    tuple[float, float], list[str], set[int], dict[str, float], Literal["a", "b", 3], Colour, Inner,
                    Inner | None, tuple[Inner, ...], TopologySettings, float | str, int | float,
                    tuple[tuple[int, int], ...] | tuple[int, int], Decimal, dict[int, str], Any]
LEAVES = st.one_of(st.none(), st.booleans(), st.integers(-2**62, 2**62),
                   st.floats(allow_nan=False, allow_infinity=False),
                   st.sampled_from(["a", "b", "c", "fixed", "positions", ""]))
JSON = st.recursive(LEAVES, lambda inner: st.one_of(
    st.lists(inner, max_size=3),
    st.dictionaries(st.sampled_from(["width", "kind", "links", "x"]), inner, max_size=3)), max_leaves=6)


@cache
def oracle(hint: Any) -> TypeAdapter[Any]:
    member = Annotated[get_args(hint)[0], Field(discriminator="kind")] if hint is TopologySettings else hint
    return TypeAdapter(list[member], config={"extra": "forbid"})


def read(hint: Any, value: Any) -> tuple[dict[str, Any], list[str]]:
    problems = Problems("few.toml")
    shape = Shape({"field": hint}, frozenset())
    return TableReader(problems, Path()).read(shape, {"field": value}, ()).values, problems.lines


@pytest.mark.parametrize("hint", HINTS, ids=str)
@given(value=JSON)
def test_a_value_is_taken_if_and_only_if_pydantic_takes_it(hint, value):
    try:
        (judged,) = oracle(hint).validate_json(json.dumps([value]), strict=True)
    except ValidationError:
        taken = False
    else:
        taken = True

    values, lines = read(hint, value)

    assert bool(lines) != taken
    if taken:
        assert values["field"] == judged
        assert type(values["field"]) is type(judged)


@pytest.mark.parametrize(("hint", "value", "lines"), [
    (tuple[float, float], [1], ["field=[1]: expected at least 2 entries, found 1"]),
    (tuple[float, float], [1, 2, 3], ["field=[1, 2, 3]: expected at most 2 entries, found 3"]),
    (Annotated[list[int], Len(1, 2)], [], ["field=[]: expected at least 1 entries, found 0"]),
    (int | str, 1.5, ["field=1.5: expected a whole number or text in quotes"]),
    (Inner | str, 1, ["field=1: expected a table or text in quotes"]),
    (Literal["ab", "cd"] | None, "ac", ["field=\"ac\": expected 'ab' or 'cd'; did you mean \"cd\"?"]),
    (Colour, "c", ["field=\"c\": expected 'a' or 'b'"]),
    (list[Inner], [{"width": -1}], ["field[0].width=-1.0: expected >= 0"]),
    (Annotated[int, Interval(ge=1)], 0, ["field=0: expected >= 1"]),
    (Decimal, "x", ['field="x": expected a valid decimal']),
    (dict[int, int], {"1": "x"}, ['field.1="x": expected a whole number']),
])
def test_what_is_wrong_with_a_value_is_said_at_its_place(hint, value, lines):
    assert read(hint, value) == ({}, [f"few.toml: {line}" for line in lines])
