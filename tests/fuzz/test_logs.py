"""A small part of the fuzzing of recorded logs, and all of it where it may take minutes."""

from __future__ import annotations

import pytest

from tests.fuzz import logs


@pytest.mark.parametrize("count", [900, pytest.param(100_000, marks=pytest.mark.slow)])
def test_a_mutated_log_is_read_or_refused_in_one_line(count: int) -> None:
    assert logs.broken(count, seed=3) == []
