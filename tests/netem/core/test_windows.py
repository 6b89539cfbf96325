"""Windows that overlap: an instant is inside if any of them holds it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.core.windows import Windows

pairs = st.tuples(st.integers(0, 50), st.integers(1, 20)).map(lambda pair: (pair[0], pair[0] + pair[1]))


@given(st.lists(pairs, max_size=8), st.integers(-1, 80))
def test_an_instant_is_inside_if_any_window_holds_it(added: list[tuple[int, int]], instant: int) -> None:
    windows = Windows()
    for start, end in added:
        windows.add(start, end)

    assert windows.hold(instant) == any(start <= instant < end for start, end in added)


def test_a_window_has_a_length() -> None:
    with pytest.raises(ValueError, match=r"window \[3, 3\): expected start < end"):
        Windows().add(3, 3)
