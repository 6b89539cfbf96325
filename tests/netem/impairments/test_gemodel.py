from __future__ import annotations

from itertools import pairwise
from math import sqrt

import numpy as np
import pytest

from netem.core.random_streams import stream
from netem.impairments.gemodel import Gemodel
from netem.impairments.gilbert_elliott import GilbertElliott

FRAMES = 200_000
NUMBERS = [(0.01, 0.1, 0.9, 0.001), (0.3, 0.2, 0.6, 0.1), (0.2, None, 1.0, 0.0)]


def chain(p, r, loss_in_bad, loss_in_good):
    """Matrices of netem's chain, state (GOOD, BAD): step with a loss, step without one; and its stationary law."""
    r = 1 - p if r is None else r
    moves = np.array([[1 - p, p], [r, 1 - r]])
    losing = np.diag([loss_in_good, loss_in_bad])
    return losing @ moves, (np.eye(2) - losing) @ moves, np.array([r, p]) / (p + r)


def check(lost, numbers):
    losing, keeping, law = chain(*numbers)
    one = np.ones(2)
    loss = float(law @ losing @ one)
    both = float(law @ losing @ losing @ one)
    values, _ = np.linalg.eig(losing + keeping)
    memory = float(min(values.real))                            # the other one is 1; bounds the correlation of losses
    widening = (1 + max(memory, 0)) / (1 - max(memory, 0))
    pairs = [a and b for a, b in pairwise(lost)]
    for found, expected in ((lost, loss), (pairs, both)):
        sigma = sqrt(expected * (1 - expected) / FRAMES * widening)
        assert abs(sum(found) / len(found) - expected) < 4 * sigma, (sum(found) / len(found), expected)


@pytest.mark.parametrize("numbers", NUMBERS)
def test_loss_and_two_losses_in_a_row_match_the_chains_matrices(numbers, frames):
    channel = Gemodel(*numbers, rng=stream(7, "netem"))

    check([not list(channel.carry(transit)) for transit in frames(FRAMES)], numbers)


@pytest.mark.parametrize("numbers", NUMBERS)
def test_gilbert_elliott_says_the_same_by_loss_ratio_and_burst(numbers, frames):
    p, r, loss_in_bad, loss_in_good = numbers
    r = 1 - p if r is None else r
    channel = GilbertElliott((p * loss_in_bad + r * loss_in_good) / (p + r), 1 / r, loss_in_bad, loss_in_good,
                             rng=stream(7, "ratio"))

    assert channel.p_enter == pytest.approx(p)
    check([not list(channel.carry(transit)) for transit in frames(FRAMES)], numbers)


def test_the_loss_is_that_of_the_state_before_the_transition(frames):
    channel = Gemodel(1.0, 1.0, rng=stream(7, "netem"))         # GOOD, BAD, GOOD, BAD, ...

    assert [not list(channel.carry(transit)) for transit in frames(6)] == [False, True] * 3


@pytest.mark.parametrize(("numbers", "message"), [
    ((1.5,), r"p=1.5: expected 0 <= p <= 1"),
    ((0.1, 0.0), r"r=0.0: the bad state would never end"),
    ((1.0,), r"r=0.0: the bad state would never end"),
    ((0.1, 0.1, 2.0), r"one_minus_h=2.0: expected 0 <= one_minus_h <= 1"),
    ((0.1, 0.1, 1.0, -1.0), r"one_minus_k=-1.0: expected 0 <= one_minus_k <= 1"),
])
def test_nonsense_is_refused_with_value_and_rule(numbers, message):
    with pytest.raises(ValueError, match=message):
        Gemodel(*numbers, rng=stream(7, "netem"))


@pytest.mark.parametrize(("settings", "message"), [
    ((0.1, 5, 0.05, 0.0), r"loss_ratio=0.1: expected loss_while_good \(0.0\) <= loss_ratio < loss_while_bad \(0.05\)"),
    ((0.1, 5, 1.0, 0.2), r"loss_ratio=0.1: expected loss_while_good \(0.2\) <= loss_ratio < loss_while_bad"),
    ((0.1, 5, 0.2, 0.2), r"loss_while_good=0.2: expected less than loss_while_bad \(0.2\)"),
])
def test_a_loss_ratio_that_the_states_cannot_give_is_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        GilbertElliott(*settings, rng=stream(7, "loss"))
