"""Joined stretches, and guarantees with bounds of years, against plain Python integers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.judge.frame_copies import FrameCopies
from experiments.judge.monitors.age_of_information import AgeOfInformation
from experiments.judge.monitors.inter_transmission_time import InterTransmissionTime
from experiments.judge.monitors.records import Records
from experiments.judge.monitors.stretches import joined
from netem.records.ledger import Row
from netem.wire.instants import NEVER_NS
from tests.examples import examples

DAY_NS = 86_400 * 10**9
STRETCHES = st.lists(st.tuples(st.integers(0, 200_000), st.integers(0, DAY_NS), st.integers(0, DAY_NS)), max_size=40)


@given(STRETCHES, st.booleans())
@settings(max_examples=examples(200), deadline=None)
def test_stretches_of_a_day_on_many_subjects_are_joined_where_they_touch(found: list[tuple[int, int, int]],
                                                                        some_never_end: bool) -> None:
    rows = sorted((subject, start, NEVER_NS if some_never_end and lasts % 5 == 0 else start + lasts)
                  for subject, start, lasts in found)
    subject, start, end = (np.array([row[k] for row in rows], dtype=np.int64) for k in range(3))

    begins = joined(subject, start, end).tolist()

    expected, reached = [], -1
    for k, (of, begin, until) in enumerate(rows):
        if k == 0 or of != rows[k - 1][0] or begin > reached:
            expected.append(k)
            reached = until
        reached = max(reached, until)
    assert begins == expected


@pytest.mark.parametrize("bound_ns", [DAY_NS, 10**18, 10**19, 10**25])
def test_a_bound_that_is_longer_than_any_run_is_kept_or_violated_without_overflow(bound_ns: int) -> None:
    rows: list[Row] = [("radio", "a", k, "b", 0, k * 10**9, k * 10**9, k * 10**9 + 1, k * 10**9 + 2, 1, b"",
                        "delivered", "") for k in range(3)]
    records = Records(DAY_NS, FrameCopies.of_rows(rows))

    age = AgeOfInformation(below_ns=bound_ns).watch([("radio", "a", "b")], records)
    apart = InterTransmissionTime(at_least_ns=bound_ns).watch([("radio", "a")], records)

    assert (age.violations, age.margin) == ((), (bound_ns - (DAY_NS - 2 * 10**9)) / 1e9)
    violation, = apart.violations
    assert (violation.from_ns, violation.until_ns) == (10**9, DAY_NS)
