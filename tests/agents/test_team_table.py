"""Mistakes in the shape of a team table: each by its key, with its value, the rule and the nearest key, all at once."""

from copy import deepcopy
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.synchronization.team import Team, TeamError, read_team
from agents.team_table import mistakes

ONE = {"A": [[-1.0]], "B": [[1.0]], "C": [[1.0]], "K": [[2.0]]}
TABLE: dict[str, Any] = {"models": {"r1": ONE, "r2": dict(ONE)}, "topology": "told", "guard_s": 20e-6,
                         "requests": [{"from_s": 0.0, "links": ["r1 -> r2", "r2 -> r1"]}]}


def changed(path: tuple[Any, ...], value: Any) -> dict[str, Any]:
    table = deepcopy(TABLE)
    inner: Any = table
    for part in path[:-1]:
        inner = inner[part]
    inner[path[-1]] = value
    return table


@pytest.mark.parametrize(("path", "value", "told"), [
    (("gard_s",), 1e-6, 'team.gard_s=1e-06: unknown key; did you mean "guard_s"?'),
    (("models", "r2", "Q"), 1, "team.models.r2.Q=1: unknown key; there are A, B, C, K, x0, d, observer_poles, "
                               "observer_x0"),
    (("requests", 0, "from"), 1.0, 'team.requests[0].from=1.0: unknown key; did you mean "from_s"?'),
    (("topology",), "heard", 'team.topology="heard": expected one of told, discovered'),
    (("slot_bound",), "shown", 'team.slot_bound="shown": expected one of printed, logarithmic norm, wirtinger'),
    (("kappa",), "x", 'team.kappa="x": expected float, got str'),
    (("models", "r2", "K"), [["x"]], 'team.models.r2.K=[["x"]]: expected float, got str, at [0][0]'),
    (("models", "r2"), {}, "team.models.r2.A: is missing"),
    (("sure",), 0, "team.sure=0: expected bool, got int"),
    (("sure",), "no", 'team.sure="no": expected bool, got str'),
    (("kappa",), "0.9", 'team.kappa="0.9": expected float, got str'),
    (("models",), 3, "team.models=3: expected object, got int"),
])
def test_a_mistake_is_told_with_key_value_rule_and_remedy(path: tuple[Any, ...], value: Any, told: str) -> None:
    with pytest.raises(TeamError) as error:
        read_team(changed(path, value))

    assert error.value.problems[0] == told


def test_equal_tables_have_one_team_that_a_changed_table_does_not_get() -> None:
    table = deepcopy(TABLE)
    first = read_team(table)
    table["models"]["r1"]["K"] = [[3.0]]

    assert read_team(deepcopy(TABLE)) is first
    assert read_team(table).models["r1"].K == [[3.0]]
    assert first.models["r1"].K == [[2.0]]
    assert not first.agents[0].K.flags.writeable


def test_all_mistakes_are_told_at_once() -> None:
    table = changed(("gard_s",), 1e-6) | {"kappa": "x"}
    del table["models"]

    with pytest.raises(TeamError) as error:
        read_team(table)

    assert [problem.partition("=")[0].partition(":")[0] for problem in error.value.problems] == [
        "team.gard_s", "team.kappa", "team.models"]


PATHS = [("models",), ("models", "r1"), ("models", "r1", "A"), ("topology",), ("requests",), ("requests", 0),
         ("requests", 0, "links"), ("guard_s",), ("kappa",), ("max_successive_losses",), ("slot_bound",), ("extra",)]
PLAIN = st.none() | st.booleans() | st.integers(-3, 3) | st.floats(-1, 1) | st.sampled_from(["told", "x"])
VALUES = st.recursive(PLAIN,
                      lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.sampled_from(["A", "r1"]), inner))


@given(path=st.sampled_from(PATHS), value=VALUES)
def test_there_is_a_mistake_exactly_where_the_table_is_no_team(path: tuple[Any, ...], value: Any) -> None:
    table = changed(path, value)

    try:
        msgspec.convert(table, Team, strict=False)
        is_team = True
    except msgspec.ValidationError:
        is_team = False

    assert (not list(mistakes(table, Team, "team"))) == is_team
