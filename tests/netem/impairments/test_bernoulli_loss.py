from __future__ import annotations

from itertools import pairwise
from math import sqrt

import pytest

from netem.core.random_streams import stream
from netem.impairments.bernoulli_loss import BernoulliLoss

FRAMES = 40_000


@pytest.mark.parametrize("loss_ratio", [0.001, 0.1, 0.5, 0.95])
def test_long_run_loss_is_binomial(loss_ratio, frames):
    channel = BernoulliLoss(loss_ratio, rng=stream(7, "loss"))

    lost = sum(not list(channel.carry(transit)) for transit in frames(FRAMES))

    sigma = sqrt(loss_ratio * (1 - loss_ratio) * FRAMES)
    assert abs(lost - loss_ratio * FRAMES) < 4 * sigma


def test_losses_do_not_depend_on_the_frame_before(frames):
    channel = BernoulliLoss(0.3, rng=stream(7, "loss"))

    lost = [not list(channel.carry(transit)) for transit in frames(FRAMES)]

    after_loss = [second for first, second in pairwise(lost) if first]
    sigma = sqrt(0.3 * 0.7 / len(after_loss))
    assert abs(sum(after_loss) / len(after_loss) - 0.3) < 4 * sigma


def test_ratios_of_zero_and_one_are_exact(frames):
    never, always = (BernoulliLoss(ratio, rng=stream(7, "loss")) for ratio in (0, 1))

    assert all(list(never.carry(transit)) for transit in frames(1000))
    assert not any(list(always.carry(transit)) for transit in frames(1000))


@pytest.mark.parametrize("loss_ratio", [-0.1, 1.2, float("nan")])
def test_a_ratio_outside_zero_to_one_is_refused(loss_ratio):
    with pytest.raises(ValueError, match=f"loss_ratio={loss_ratio}: expected 0 <= loss_ratio <= 1"):
        BernoulliLoss(loss_ratio, rng=stream(7, "loss"))
