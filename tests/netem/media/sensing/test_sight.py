from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from netem.media.sensing.sight import (
    Body,
    Detection,
    NothingSeen,
    pack_body,
    pack_detection,
    pack_nothing,
    unpack_body,
    unpack_sight,
)


def test_what_is_packed_is_what_is_unpacked():
    body, detection = Body(1.5, -2.0, 0.25, 3.0), Detection(70_000_000, 1.0, 2.0, -3.0, "Ålesund")

    assert unpack_body(pack_body(body)) == body
    assert unpack_sight(pack_detection(detection)) == detection
    assert unpack_sight(pack_nothing(5)) == NothingSeen(5)


@pytest.mark.parametrize("value", [nan, inf])
def test_a_body_at_no_finite_place_is_none(value):
    assert unpack_body(pack_body(Body(0.0, value, 0.0, 0.0))) is None


@given(st.binary(max_size=60) | st.binary(max_size=60).map(lambda rest: b"D" + rest))
def test_random_bytes_never_raise(data):
    body, sight = unpack_body(data), unpack_sight(data)

    assert body is None or len(data) == 33
    assert sight is None or data[:1] in (b"D", b"N")
