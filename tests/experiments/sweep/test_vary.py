"""What `--vary` says, as a grid and as a Latin hypercube."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.sweep.vary import BadCampaign, Varied, grid, latin, of_values, parse


@pytest.mark.parametrize(("text", "values"), [
    ("length_s=1,2.5", (1, 2.5)),
    ("impairments[0].loss_ratio=0:0.4:3", (0.0, 0.2, 0.4)),
    ("a.b=1:5:3", (1, 3, 5)),
    ("a.b=1:4:3", (1.0, 2.5, 4.0)),
    ("a.b=-1e-3:1e-3:3", (-1e-3, 0.0, 1e-3)),
    ('media.radio.preset="xbee_s2c","crazyflie_p2p"', ("xbee_s2c", "crazyflie_p2p")),
    ("a.list=[1,2],[3]", ([1, 2], [3])),
    ("a.flag=true,false", (True, False)),
])
def test_values_are_those_of_toml_and_a_range_has_both_of_its_ends(text: str, values: tuple[object, ...]) -> None:
    found = parse(text).values

    assert found == values
    assert [type(value) for value in found] == [type(value) for value in values]


@pytest.mark.parametrize(("text", "why"), [
    ("loss_ratio", "expected KEY=a,b,c or KEY=lo:hi:n"),
    ("=1,2", "expected KEY=a,b,c or KEY=lo:hi:n"),
    ("a.b=", "has no value"),
    ("a.b=xbee", "no list of TOML values; text needs quotes"),
    ("a.b=5:1:3", "expected lo < hi"),
    ("a.b=1:5:1", "expected 2 values or more"),
    ("a.b=1:1e999:3", "expected lo < hi"),
    ("seed=1,2", "is not varied: --seeds N"),
])
def test_what_cannot_be_read_is_refused_in_one_line(text: str, why: str) -> None:
    with pytest.raises(BadCampaign) as refused:
        parse(text)

    assert why in str(refused.value)
    assert str(refused.value).startswith(f"--vary {text}: ")
    assert "\n" not in str(refused.value)


def test_a_grid_has_every_combination_the_last_key_fastest() -> None:
    assert grid([parse("a=1,2"), parse("b=true,false")]) == [
        {"a": 1, "b": True}, {"a": 1, "b": False}, {"a": 2, "b": True}, {"a": 2, "b": False}]
    assert grid([]) == [{}]


def test_a_grid_of_a_continuous_range_or_of_one_key_twice_is_refused() -> None:
    with pytest.raises(BadCampaign, match="a grid needs the number of values"):
        grid([parse("a=0:1")])
    with pytest.raises(BadCampaign, match="is varied twice"):
        grid([parse("a=1"), parse("a=2")])


@given(st.integers(1, 60), st.integers(0, 2**32), st.floats(-1e6, 1e6), st.floats(1e-3, 1e6))
def test_each_part_of_a_range_is_drawn_from_once(settings: int, seed: int, low: float, width: float) -> None:
    drawn = latin([Varied("a", limits=(low, low + width)), Varied("b", tuple(range(settings)))], settings, seed)

    # a value at the border of two parts may be rounded into either: with widths of at least 1e-9 of the size of the
    # ends, 6 digits of each part are exact, so a border is met with a probability below 1e-6
    parts = sorted(int((setting["a"] - low) / width * settings) for setting in drawn)
    assert parts == list(range(settings))
    assert sorted(setting["b"] for setting in drawn) == list(range(settings))


def test_the_same_seed_draws_the_same_settings() -> None:
    varied = [parse("a=0:1"), parse('b="x","y"')]

    assert latin(varied, 10, 3) == latin(varied, 10, 3) != latin(varied, 10, 4)


def test_a_hypercube_of_nothing_or_of_no_run_is_refused() -> None:
    with pytest.raises(BadCampaign, match="nothing is varied"):
        latin([], 5, 0)
    with pytest.raises(BadCampaign, match="--runs 0: expected 1"):
        latin([parse("a=0:1")], 0, 0)


def test_python_values_are_taken_as_they_are() -> None:
    assert of_values("team.gain", [1, 2.0]).values == (1, 2.0)
    with pytest.raises(BadCampaign, match="has no value"):
        of_values("team.gain", [])
    with pytest.raises(BadCampaign, match=r"expected path\.to\.key"):
        of_values("team gain", [1])
