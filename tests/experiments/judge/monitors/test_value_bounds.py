"""Reported numbers within bounds: by hand, and against the value that holds at every nanosecond."""

from __future__ import annotations

from itertools import groupby
from math import inf, nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.judge.frame_copies import FrameCopies
from experiments.judge.monitors.records import Records
from experiments.judge.monitors.reported import Reported, number_in
from experiments.judge.monitors.signal import Signal
from netem.records.events import Event
from netem.records.signal_table import SignalTable
from tests.examples import examples

GAIN = ("robot", "gain product")


def told(*values: tuple[int, str], length: int = 100) -> Records:
    events = [Event(time, "robot", "gain product", detail) for time, detail in values]
    return Records(length, FrameCopies.of_rows([]), {}, events)


def sampled(times: list[int], values: list[float], length: int = 100) -> Records:
    table = SignalTable("robot", ("other", "gain"), ("1", "1"), np.array(times, dtype=np.int64),
                        np.column_stack([np.zeros(len(values)), values]) if values else np.zeros((0, 2)))
    return Records(length, FrameCopies.of_rows([]), {"robot": table})


def test_a_product_that_reaches_one_violates_from_its_report_to_the_next_below_one() -> None:
    found = Reported(below=1.0).watch([GAIN], told((10, "0.9"), (20, "1.0 at 0.3 m/s"), (30, "1.25"), (47, "0.5")))

    violation, = found.violations
    assert (violation.on, violation.node, violation.from_ns, violation.until_ns) == (
        "robot.gain product", "robot", 20, 47)
    assert (violation.worst, violation.cause) == (1.25, "it is 1.0 at 0.3 m/s")
    assert (found.worst, found.margin) == (1.25, -0.25)


def test_two_reports_at_one_instant_are_both_judged() -> None:
    found = Reported(below=1.0).watch([GAIN], told((20, "3"), (20, "0.5")))

    assert [(violation.from_ns, violation.until_ns) for violation in found.violations] == [(20, 20)]


def test_without_any_report_there_is_nothing_to_judge() -> None:
    assert not Reported(below=1.0).watch([GAIN], told()).judged
    assert not Signal(below=1.0).watch([("robot", "gain")], sampled([], [])).judged
    assert not Signal(below=1.0).watch([("robot", "gian")], sampled([1], [2.0])).judged


def test_what_is_no_number_is_within_no_bounds() -> None:
    found = Signal(below=1.0, above=-1.0).watch([("robot", "gain")], sampled([0, 10, 20], [0.5, nan, 0.0]))

    assert [(violation.from_ns, violation.until_ns) for violation in found.violations] == [(10, 20)]
    assert np.isnan(found.worst)


def test_the_worst_value_is_the_one_furthest_beyond_its_own_bound() -> None:
    found = Signal(below=10.0, above=0.0).watch([("robot", "gain")], sampled([0, 10, 20], [12.0, -5.0, 8.0]))

    violation, = found.violations
    assert (violation.worst, found.worst, found.margin) == (-5.0, -5.0, -5.0)


@pytest.mark.parametrize(("detail", "number"), [
    ("0.93", 0.93), ("1e-3 at x", 1e-3), (" -2. ", -2.0), ("inf", inf), ("-inf", -inf), (".5;", 0.5), ("+3,", 3.0)])
def test_a_text_that_begins_with_a_number_tells_it(detail: str, number: float) -> None:
    assert number_in(detail) == number


@pytest.mark.parametrize("detail", ["", "L1", "nan", "1x", "1.2.3", "infinite", "--1", "9" * 5 + "e", "0x10"])
def test_other_texts_tell_none(detail: str) -> None:
    assert np.isnan(number_in(detail))


@given(st.text(max_size=30))
def test_no_text_raises(detail: str) -> None:
    number_in(detail)


@given(st.lists(st.tuples(st.integers(0, 59), st.sampled_from([-2.0, -1.0, 0.0, 0.5, 1.0, 3.0, nan, inf])), max_size=12,
                unique_by=lambda pair: pair[0]), st.sampled_from([(None, 1.0), (-1.0, None), (-1.0, 1.0)]))
@settings(max_examples=examples(150), deadline=None)
def test_it_is_violated_at_exactly_the_nanoseconds_at_which_the_last_value_is_out_of_bounds(
        samples: list[tuple[int, float]], bounds: tuple[float | None, float | None]) -> None:
    above, below = bounds
    samples.sort()

    data = sampled([t for t, _ in samples], [v for _, v in samples], 60)
    found = Signal(below, above).watch([("robot", "gain")], data)

    def violated(t: int) -> bool:
        values = [value for time, value in samples if time <= t]
        return bool(values) and not ((below is None or values[-1] < below) and (above is None or values[-1] > above))
    expected, at = [], 0
    for state, group in groupby(range(60), violated):
        end = at + len(list(group))
        expected += [(at, end)] if state else []
        at = end
    assert [(violation.from_ns, violation.until_ns) for violation in found.violations] == expected
    assert found.judged == bool(samples)


@pytest.mark.parametrize(("fields", "says"), [
    ({}, "give below, above or both"), ({"below": 1.0, "above": 1.0}, "nothing lies between"),
    ({"below": 0.0, "above": 1.0}, "nothing lies between")])
def test_bounds_that_guarantee_nothing_or_the_impossible_are_refused(fields: dict[str, float], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        Signal(**fields)


def test_an_event_that_no_node_told_is_named_with_the_nearest() -> None:
    records = Records(100, FrameCopies.of_rows([]), {}, [Event(5, "robot", "gain product", "0.5"),
                                                         Event(5, "other", "gain produt", "0.5")])

    finding = Reported(below=1.0).watch([("robot", "gain produt")], records)

    assert not finding.judged
    assert finding.why == "no node that it names told an event 'gain produt'; nearest: 'gain product'"
