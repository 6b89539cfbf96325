from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from scipy import stats

from netem.core.random_streams import stream
from netem.core.transit import Transit
from netem.impairments.corrupt import Corrupt

SIGNIFICANCE = 1e-3
FRAMES = 8000


def flipped(before: bytes, after: bytes) -> np.ndarray:
    """Positions of the bits that differ, from the first byte's most significant bit."""
    return np.flatnonzero(np.unpackbits(np.frombuffer(before, np.uint8) ^ np.frombuffer(after, np.uint8)))


@pytest.mark.parametrize("bit_error_ratio", [0.001, 0.02, 0.5])
def test_flips_per_frame_are_binomial(bit_error_ratio, frames):
    data = bytes(range(50))
    noise = Corrupt(bit_error_ratio, rng=stream(7, "noise"))

    flips = np.array([len(flipped(data, copy.data)) for transit in frames(FRAMES, data=data)
                      for copy in noise.carry(transit)])

    law = stats.binom(8 * len(data), bit_error_ratio)
    low, high = int(law.ppf(10 / FRAMES)), int(law.isf(10 / FRAMES))        # at least 10 expected in either tail
    found = [np.sum(flips <= low), *(np.sum(flips == k) for k in range(low + 1, high)), np.sum(flips >= high)]
    expected = [law.cdf(low), *(law.pmf(k) for k in range(low + 1, high)), law.sf(high - 1)]
    assert stats.chisquare(found, np.array(expected) * FRAMES).pvalue > SIGNIFICANCE


def test_frames_stay_whole_with_the_probability_of_their_length():
    noise = Corrupt(0.001, rng=stream(7, "noise"))
    sizes = [1, 20, 250]

    whole = dict.fromkeys(sizes, 0)
    for n in range(3 * FRAMES):
        size = sizes[n % 3]
        [copy] = noise.carry(Transit(n, n, n, bytes(size)))
        whole[size] += not copy.corrupt

    for size in sizes:
        p = (1 - 0.001) ** (8 * size)
        assert abs(whole[size] - p * FRAMES) < 4 * sqrt(p * (1 - p) * FRAMES)


@pytest.mark.parametrize("settings", [{"bit_error_ratio": 0.02}, {"frame_ratio": 1.0}])
def test_every_bit_of_the_frame_is_hit_equally_often(settings, frames):
    data = b"five!"
    noise = Corrupt(**settings, rng=stream(7, "noise"))

    hits = np.concatenate([flipped(data, copy.data) for transit in frames(FRAMES, data=data)
                           for copy in noise.carry(transit)])

    assert stats.chisquare(np.bincount(hits, minlength=40)).pvalue > SIGNIFICANCE


def test_a_share_of_the_frames_has_exactly_one_bit_flipped(frames):
    noise = Corrupt(frame_ratio=0.2, rng=stream(7, "noise"))
    data = b"0123456789"

    flips = [len(flipped(data, copy.data)) for transit in frames(FRAMES, data=data) for copy in noise.carry(transit)]

    assert set(flips) == {0, 1}
    assert abs(sum(flips) - 0.2 * FRAMES) < 4 * sqrt(0.2 * 0.8 * FRAMES)


def test_frames_between_two_bit_errors_cost_no_draw(frames):
    noise = Corrupt(bit_error_ratio=1e-4, rng=stream(7, "noise"))
    first, *others = frames(200, data=b"1234567890")
    list(noise.carry(first))

    for transit in others:
        before = noise.rng.getstate()
        [copy] = noise.carry(transit)
        assert copy.corrupt == (noise.rng.getstate() != before)


@pytest.mark.parametrize("settings", [{"bit_error_ratio": 0.9}, {"frame_ratio": 1.0}])
def test_an_empty_frame_has_no_bit_to_flip(settings, frames):
    noise = Corrupt(**settings, rng=stream(7, "noise"))

    [copy] = noise.carry(frames(1, data=b"")[0])

    assert not copy.corrupt


@pytest.mark.parametrize("settings", [{"bit_error_ratio": 0.0}, {"frame_ratio": 0.0}, {"bit_error_ratio": 1e-300}])
def test_hardly_ever_is_never_here(settings, frames):
    noise = Corrupt(**settings, rng=stream(7, "noise"))

    assert not any(copy.corrupt for transit in frames(1000) for copy in noise.carry(transit))


@pytest.mark.parametrize(("settings", "message"), [
    ({}, "bit_error_ratio=None, frame_ratio=None: give exactly one of them"),
    ({"bit_error_ratio": 0.1, "frame_ratio": 0.1}, "give exactly one of them"),
    ({"bit_error_ratio": 1.0}, "bit_error_ratio=1.0: expected 0 <= bit_error_ratio < 1"),
    ({"frame_ratio": 2.0}, "frame_ratio=2.0: expected 0 <= frame_ratio <= 1"),
])
def test_nonsense_is_refused_with_value_and_rule(settings, message):
    with pytest.raises(ValueError, match=message):
        Corrupt(**settings, rng=stream(7, "noise"))
