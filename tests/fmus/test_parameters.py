from __future__ import annotations

import pytest

from fmus.errors import PlantError
from fmus.parameters import expand_parameters


def test_lists_become_indexed_names_and_the_rest_stays() -> None:
    assert expand_parameters({"A": [[-3, 1], [2, -1]], "x0": [1, 2], "R": 1.2, "on": True, "s": "ab"}) == {
        "A[1,1]": -3, "A[1,2]": 1, "A[2,1]": 2, "A[2,2]": -1, "x0[1]": 1, "x0[2]": 2, "R": 1.2, "on": True, "s": "ab"}


@pytest.mark.parametrize("ragged", [[[1, 2], [3]], [[1], 2], [[], [1]]])
def test_ragged_rows_are_refused(ragged: list[object]) -> None:
    with pytest.raises(PlantError, match="A: "):
        expand_parameters({"A": ragged})       # type: ignore[dict-item]


def test_an_empty_list_is_refused() -> None:
    with pytest.raises(PlantError, match="A: an empty list"):
        expand_parameters({"A": []})
