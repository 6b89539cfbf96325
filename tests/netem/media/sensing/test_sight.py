from hypothesis import given
from hypothesis import strategies as st

from netem.media.sensing.sight import (
    Detection,
    NothingSeen,
    pack_detection,
    pack_nothing,
    unpack_sight,
)


def test_what_is_packed_is_what_is_unpacked():
    detection = Detection(70_000_000, 1.0, 2.0, -3.0, "Ålesund")

    assert unpack_sight(pack_detection(detection)) == detection
    assert unpack_sight(pack_nothing(5)) == NothingSeen(5)


@given(st.binary(max_size=60) | st.binary(max_size=60).map(lambda rest: b"D" + rest))
def test_random_bytes_never_raise(data):
    sight = unpack_sight(data)

    assert sight is None or data[:1] in (b"D", b"N")
