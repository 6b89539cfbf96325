"""Delta debugging: what is left fails and is 1-minimal, and how many tests that takes."""

from __future__ import annotations

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from experiments.search.ddmin import ddmin


def test_any_two_of_forty_items_are_found_in_at_most_28_tests() -> None:
    for pair in combinations(range(40), 2):
        asked: set[tuple[int, ...]] = set()

        def fails(items: tuple[int, ...], pair: tuple[int, int] = pair, asked: set[tuple[int, ...]] = asked) -> bool:
            asked.add(items)
            return set(pair) <= set(items)

        assert ddmin(range(40), fails) == pair
        assert len(asked) <= 28


@given(st.integers(1, 24), st.lists(st.sets(st.integers(0, 23), min_size=1, max_size=4), min_size=1, max_size=3),
       st.sets(st.integers(0, 23), max_size=2))
def test_what_is_left_fails_and_no_single_item_can_be_left_out(size: int, causes: list[set[int]], cures: set[int]
                                                               ) -> None:
    """Any of several causes, unless an odd number of cures is there: not monotone."""
    def fails(items: tuple[int, ...]) -> bool:
        return any(cause <= set(items) for cause in causes) and len(cures & set(items)) % 2 == 0

    items = tuple(range(size))
    if not fails(items):
        return

    kept = ddmin(items, fails)

    assert fails(kept)
    assert len(kept) == 1 or not any(fails(tuple(item for item in kept if item != out)) for out in kept)
