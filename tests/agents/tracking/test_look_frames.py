"""Frames of a look survive the way there, and nothing else gets through."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from agents.tracking.controller import Inputs, Pose
from agents.tracking.look_frames import (
    UNASKED,
    ReferenceState,
    pack_answer,
    pack_request,
    unpack_answer,
    unpack_request,
)

STATE = ReferenceState(Pose(1.5, -2.0, 0.25), Inputs(0.6, 0.15))


def test_there_and_back():
    assert unpack_request(pack_request(77)) == 77
    assert unpack_answer(pack_answer(UNASKED, STATE)) == (UNASKED, STATE)


def test_no_request_ever_carries_the_number_of_an_unasked_answer():
    assert UNASKED not in {unpack_request(pack_request(look)) for look in range(3 * UNASKED)}


@given(st.binary(max_size=60))
def test_random_bytes_are_refused_or_are_a_frame(data):
    """What is taken for a frame packs to the very same bytes."""
    look, answer = unpack_request(data), unpack_answer(data)
    assert look is None or data == pack_request(look) or look == UNASKED
    assert answer is None or data == pack_answer(*answer)


def test_an_answer_that_is_not_finite_is_refused():
    broken = STATE._replace(pose=Pose(float("nan"), 0.0, 0.0))
    assert unpack_answer(pack_answer(3, broken)) is None
