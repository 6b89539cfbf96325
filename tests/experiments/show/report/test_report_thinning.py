"""Laws of thinning: few points, both ends, every peak."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from experiments.show.report.thinning import keep
from tests.examples import examples

CURVES = arrays(np.float64, st.integers(0, 400), elements=st.floats(-1e6, 1e6) | st.just(np.nan))


@given(CURVES, st.integers(4, 60))
@settings(max_examples=examples(200), deadline=None)
def test_what_is_kept_is_few_in_order_and_has_the_ends_and_the_extremes(values: np.ndarray, most: int) -> None:
    kept = keep(values, most)

    assert kept.size <= max(values.size if values.size <= most else 0, most)
    assert (np.diff(kept) > 0).all()
    if values.size:
        assert (kept[0], kept[-1]) == (0, values.size - 1)
    if values.size and not np.isnan(values).all():
        assert np.nanmin(values[kept]) == np.nanmin(values)
        assert np.nanmax(values[kept]) == np.nanmax(values)


def test_a_spike_of_one_sample_in_a_million_stays() -> None:
    values = np.sin(np.arange(1_000_000) / 1000)
    values[654_321] = 7.0

    kept = keep(values)

    assert 654_321 in kept
    assert kept.size <= 5_000


def test_short_curves_are_left_alone() -> None:
    assert keep(np.arange(5_000.0)).size == 5_000
