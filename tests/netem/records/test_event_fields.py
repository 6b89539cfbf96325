"""Details of events as named values: what is written reads back, other details are none."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.records.event_fields import corners, place, read, written

WORDS = st.text(max_size=20)
NAMES = st.from_regex(r"\A[A-Za-z]\w{0,8}\Z")


@given(st.dictionaries(NAMES, WORDS, min_size=1))
def test_texts_read_back_whatever_signs_they_hold(fields: dict[str, str]) -> None:
    assert read(written(fields)) == fields


@given(st.dictionaries(NAMES, st.floats(allow_nan=False), min_size=1))
def test_numbers_read_back_to_six_digits(fields: dict[str, float]) -> None:
    found = read(written(fields))

    assert found is not None
    assert {name: float(value) for name, value in found.items()} == {
        name: pytest.approx(value, rel=5.1e-6, abs=1e-320) for name, value in fields.items()}


@pytest.mark.parametrize("detail", [
    "", "target_1", "target 0 stage 1", "a=1 ", " a=1", "a=1  b=2", "a=1 b", "1a=2", "a=", 'a="open', 'a=x"y"',
    'a="\\q"', "gain=0.1, way=2 m", "a=1\nb=2"])
def test_a_detail_of_another_form_has_no_values(detail: str) -> None:
    assert read(detail) is None


@pytest.mark.parametrize("name", ["", "1st", "way m", "P-R", "a="])
def test_a_name_that_would_not_read_back_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="expected letters, digits and _, a letter first"):
        written({name: 1.0})


def test_a_place_has_two_finite_numbers() -> None:
    assert place({"x_m": "1.5", "y_m": "-2"}) == (1.5, -2.0)
    for wrong in ({}, {"x_m": "1"}, {"x_m": "1", "y_m": "north"}, {"x_m": "nan", "y_m": "1"}):
        assert place(wrong) is None


def test_corners_read_back_and_one_wrong_corner_leaves_none() -> None:
    shape = [(0.0, 0.5), (4.25, 0.0), (-4.0, 3.0)]
    found = read(written({"target": "target_1", "corners_m": shape}))

    assert found is not None
    assert corners(found) == shape
    assert [corners({"corners_m": text}) for text in ("", "1,1;2", "1,1;2,x", "1,1;")] == [[]] * 4
    assert corners(read(written({"corners_m": []})) or {}) == []
