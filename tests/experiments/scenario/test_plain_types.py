"""What `plain_values` accepts, pydantic accepts with equal values; what pydantic refuses, it does not accept."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import pytest
from annotated_types import Ge, Gt
from hypothesis import given
from hypothesis import strategies as st

from experiments.scenario import load, table_types
from experiments.scenario.library import catalog
from experiments.scenario.plain_types import plain_values
from experiments.scenario.shape import Shape
from netem.topology.table import TopologySettings


@dataclass(frozen=True)
class Inner:
    width: float
    kind: Literal["a", "b"] = "a"

    def __post_init__(self) -> None:
        if self.width < 0:
            raise ValueError(f"width={self.width}: expected >= 0")


HINTS: list[Any] = [int, float, str, bool, int | None, Annotated[int, Ge(0)], Annotated[float, Gt(0.5)],
                    tuple[int, ...], tuple[float, float], list[str], dict[str, float], Literal["a", "b", 3], Inner,
                    Inner | None, tuple[Inner, ...], TopologySettings, float | str, Any]
LEAVES = st.one_of(st.none(), st.booleans(), st.integers(-2**62, 2**62),
                   st.floats(allow_nan=False, allow_infinity=False),
                   st.sampled_from(["a", "b", "c", "fixed", "positions", ""]))
JSON = st.recursive(LEAVES, lambda inner: st.one_of(
    st.lists(inner, max_size=3),
    st.dictionaries(st.sampled_from(["width", "kind", "links", "x"]), inner, max_size=3)), max_leaves=6)


@pytest.mark.parametrize("hint", HINTS, ids=str)
@given(value=JSON)
def test_accepted_values_are_those_of_pydantic(hint, value):
    shape = Shape({"field": hint}, frozenset())

    plain = plain_values(shape, {"field": value})

    if plain is not None:
        judged = table_types._values(table_types._model(shape), {"field": value})
        assert plain == judged
        assert type(plain["field"]) is type(judged["field"])


@pytest.mark.parametrize("entry", catalog(), ids=lambda entry: entry.name)
def test_every_scenario_of_ours_is_read_alike_with_and_without(entry, monkeypatch):
    quickly = load(entry.path).resolved()
    monkeypatch.setattr(table_types, "plain_values", lambda shape, ready: None)

    assert load(entry.path).resolved() == quickly
