"""Groups in sorted columns, against plain loops over Python ints."""

from __future__ import annotations

from itertools import groupby, pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.judge.groups import largest_so_far, new_group
from tests.examples import examples

ROWS = st.lists(st.tuples(st.integers(0, 5), st.integers(-2**63, 2**63 - 1)), max_size=60).map(
    lambda rows: sorted(rows, key=lambda row: row[0]))


@given(ROWS)
@settings(max_examples=examples(200), deadline=None)
def test_a_group_begins_where_a_column_changes(rows: list[tuple[int, int]]) -> None:
    group, value = (np.array(column, dtype=np.int64) for column in zip(*rows, strict=True)) if rows else (
        np.zeros(0, dtype=np.int64),) * 2

    starts = new_group(group, value)

    assert starts.tolist() == [True, *(one != other for one, other in pairwise(rows))][:len(rows)]


@given(ROWS)
@settings(max_examples=examples(200), deadline=None)
def test_the_running_maximum_stays_within_its_group_whatever_the_values(rows: list[tuple[int, int]]) -> None:
    group, value = (np.array([row[k] for row in rows], dtype=np.int64) for k in (0, 1))

    found = largest_so_far(group, value)

    expected: list[int] = []
    for _, own in groupby(rows, key=lambda row: row[0]):
        values = [row[1] for row in own]
        expected += [max(values[:k + 1]) for k in range(len(values))]
    assert found.tolist() == expected
