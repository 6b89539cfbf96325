from __future__ import annotations

from itertools import groupby
from math import sqrt

import numpy as np
import pytest
from scipy import stats

from netem.core.random_streams import stream
from netem.impairments.gilbert_elliott import GilbertElliott

FRAMES = 60_000
SIGNIFICANCE = 1e-3
settings = pytest.mark.parametrize(("loss_ratio", "mean_burst_frames"), [(0.02, 1), (0.1, 5), (0.4, 12), (0.75, 3)])


def losses(loss_ratio, mean_burst_frames, transits):
    channel = GilbertElliott(loss_ratio, mean_burst_frames, rng=stream(7, "uplink/loss"))
    return channel, [not list(channel.carry(transit)) for transit in transits]


@settings
def test_long_run_loss_matches_the_closed_form(loss_ratio, mean_burst_frames, frames):
    channel, lost = losses(loss_ratio, mean_burst_frames, frames(FRAMES))

    memory = 1 - channel.p_enter - channel.p_leave          # lag-1 correlation of the chain
    sigma = sqrt(loss_ratio * (1 - loss_ratio) / FRAMES * (1 + memory) / (1 - memory))
    assert abs(sum(lost) / FRAMES - loss_ratio) < 4 * sigma


@settings
def test_bursts_are_geometric_with_the_mean_asked_for(loss_ratio, mean_burst_frames, frames):
    _, lost = losses(loss_ratio, mean_burst_frames, frames(FRAMES))

    bursts = np.array([len(list(run)) for bad, run in groupby(lost) if bad][:-1])
    sigma = sqrt(mean_burst_frames * (mean_burst_frames - 1) / len(bursts))     # geometric: variance m (m - 1)
    assert abs(bursts.mean() - mean_burst_frames) <= 4 * sigma
    if mean_burst_frames > 1:
        assert chi_square_p(bursts, stats.geom(1 / mean_burst_frames)) > SIGNIFICANCE


def chi_square_p(lengths, law) -> float:
    """Lengths 1, 2, ... in classes of at least 10 expected, the last one open."""
    last = int(law.isf(10 / len(lengths)))
    expected = [law.pmf(k) * len(lengths) for k in range(1, last)] + [law.sf(last - 1) * len(lengths)]
    found = [int(np.sum(lengths == k)) for k in range(1, last)] + [int(np.sum(lengths >= last))]
    return float(stats.chisquare(found, expected).pvalue)


def test_gaps_between_bursts_are_geometric_too(frames):
    channel, lost = losses(0.1, 5, frames(FRAMES))

    gaps = np.array([len(list(run)) for bad, run in groupby(lost) if not bad][1:-1])
    assert chi_square_p(gaps, stats.geom(channel.p_enter)) > SIGNIFICANCE


def test_the_channel_starts_good_and_never_loses_at_ratio_zero(frames):
    channel, lost = losses(0, 5, frames(1000))

    assert not channel.bad
    assert not any(lost)


@pytest.mark.parametrize(("settings", "message"), [
    ((1.0, 5), r"loss_ratio=1.0: expected 0 <= loss_ratio < 1"),
    ((0.1, 0.5), r"mean_burst_frames=0.5: a burst holds at least 1 frame"),
    ((0.8, 2), r"loss_ratio=0.8 is out of reach with bursts of 2 frames: raise mean_burst_frames to 4 or more"),
])
def test_nonsense_is_refused_with_value_and_rule(settings, message):
    with pytest.raises(ValueError, match=message):
        GilbertElliott(*settings, rng=stream(7, "loss"))
