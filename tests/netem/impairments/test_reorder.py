from __future__ import annotations

from math import sqrt

import pytest

from netem.core.random_streams import stream
from netem.impairments.reorder import Reorder

FRAMES = 30_000


@pytest.mark.parametrize(("ratio", "gap_frames"), [(0.25, 1), (0.6, 5), (0.02, 2)])
def test_the_number_that_passes_at_once_is_that_of_the_renewal_process(ratio, gap_frames, frames):
    reorder = Reorder(1000, ratio, gap_frames, rng=stream(7, "reorder"))

    chosen = sum(copy.arrival_ns == transit.arrival_ns for transit in frames(FRAMES) for copy in reorder.carry(transit))

    mean = gap_frames - 1 + 1 / ratio                       # frames from one chosen to the next: gap - 1 + geometric
    sigma = sqrt(FRAMES * (1 - ratio) / ratio ** 2 / mean ** 3)
    assert abs(chosen - FRAMES / mean) < 4 * sigma + 1      # 1: the renewal in progress at the end


def test_with_a_gap_alone_every_fifth_passes_and_all_others_are_held(frames):
    reorder = Reorder(hold_ns=700, gap_frames=5, rng=stream(7, "reorder"))

    held_ns = [copy.arrival_ns - transit.arrival_ns for transit in frames(20) for copy in reorder.carry(transit)]

    assert held_ns == [700, 700, 700, 700, 0] * 4


def test_a_chosen_copy_overtakes_those_held_that_entered_less_than_the_hold_before_it(frames):
    reorder = Reorder(hold_ns=3_500_000, reorder_ratio=0.3, rng=stream(7, "reorder"))
    transits = frames(400)

    out = [copy for transit in transits for copy in reorder.carry(transit)]

    chosen = {copy.number for copy in out if copy.arrival_ns == copy.sent_ns}
    overtaken = {(late.number, early.number) for late in out for early in out
                 if late.number > early.number and late.arrival_ns < early.arrival_ns}
    assert overtaken == {(c, e) for c in chosen for e in range(max(0, c - 3), c) if e not in chosen}
    assert overtaken


@pytest.mark.parametrize(("settings", "message"), [
    ({"hold_ns": 0, "reorder_ratio": 0.5}, "hold_ns=0: expected hold_ns >= 1"),
    ({"hold_ns": 5}, "every copy would pass at once and none overtake"),
    ({"hold_ns": 5, "gap_frames": 0}, "gap_frames=0: expected gap_frames >= 1"),
    ({"hold_ns": 5, "reorder_ratio": -0.5}, "expected 0 <= reorder_ratio <= 1"),
])
def test_nonsense_is_refused_with_value_and_rule(settings, message):
    with pytest.raises(ValueError, match=message):
        Reorder(**settings, rng=stream(7, "reorder"))
