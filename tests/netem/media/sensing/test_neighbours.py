"""The search for bodies near a camera against the distance to each of them."""

from __future__ import annotations

from math import hypot, inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.media.sensing.neighbours import neighbours_within
from netem.media.sensing.sight import Body

places = st.floats(-100.0, 100.0)
bodies_at = st.lists(st.builds(Body, places, places, places, places), max_size=20)


@given(bodies_at, st.builds(Body, places, places, places, places), st.sampled_from([0.1, 10.0, 50.0, inf]))
def test_the_search_finds_who_is_in_range_on_the_ground_and_nobody_else(bodies, camera, range_m):
    named = {f"body_{number}": body for number, body in enumerate(bodies)}

    found = list(neighbours_within(range_m)(named)(camera))

    away_m = {name: hypot(body.x_m - camera.x_m, body.y_m - camera.y_m) for name, body in named.items()}
    assert found == sorted(found)
    assert {name for name in named if away_m[name] <= range_m} <= set(found)
    assert all(away_m[name] <= range_m * (1 + 1e-8) for name in found)


@pytest.mark.parametrize("range_m", [1.0, inf])
def test_without_bodies_it_finds_none(range_m):
    assert list(neighbours_within(range_m)({})(Body(0.0, 0.0, 0.0, 0.0))) == []
