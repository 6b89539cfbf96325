"""Times of a file against exact fractions."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.scenario.units import siblings, spellings, to_ns
from netem.wire.instants import NS_PER


@pytest.mark.parametrize(("value", "unit", "ns"), [
    (13.0, "s", 13_000_000_000), (0.0011, "s", 1_100_000), (8.71074e-4, "s", 871_074), (1.5, "ms", 1_500_000),
    (20, "us", 20_000), (7, "ns", 7), (0.1, "s", 100_000_000), (1e-9, "s", 1), (-5, "us", -5_000), (0, "s", 0),
    (1.4, "ns", 1), (1.6, "ns", 2)])
def test_a_time_is_its_decimal_value_in_nanoseconds(value, unit, ns):
    assert to_ns(value, unit) == ns


@given(st.integers(-10**15, 10**15), st.integers(0, 12), st.sampled_from(sorted(NS_PER)))
def test_what_is_written_is_within_half_a_nanosecond_of_what_is_meant(digits, places, unit):
    text = f"{digits}e-{places}"
    exact = Fraction(digits, 10**places) * NS_PER[unit]

    try:
        ns = to_ns(float(text), unit)
    except ValueError:
        assert abs(exact) >= 2**62 or 0 < abs(exact) <= Fraction(1, 2)
        return

    assert abs(ns - Fraction(repr(float(text))) * NS_PER[unit]) <= Fraction(1, 2)


@pytest.mark.parametrize(("value", "rule"), [
    (True, "a number"), ("5", "a number"), (float("nan"), "finite"), (float("inf"), "finite"),
    (1e-11, "less than half"), (5e9, "end of time")])
def test_what_is_no_time_is_refused(value, rule):
    with pytest.raises(ValueError, match=rule):
        to_ns(value, "s")


def test_only_fields_that_end_in_ns_have_spellings():
    assert list(spellings("delay_ns")) == ["delay_s", "delay_ms", "delay_us", "delay_ns"]
    assert spellings("loss_ratio") == spellings("_ns") == spellings("ns") == {}


def test_the_other_spellings_of_a_time_are_known():
    assert siblings("length_s") == ["length_ms", "length_us", "length_ns"]
    assert siblings("loss_ratio") == []
