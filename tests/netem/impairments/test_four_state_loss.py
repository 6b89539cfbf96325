from __future__ import annotations

from itertools import pairwise
from math import sqrt

import numpy as np
import pytest

from netem.core.random_streams import stream
from netem.impairments.four_state_loss import FourStateLoss

FRAMES = 60_000
chains = pytest.mark.parametrize(("p13", "p31", "p32", "p23", "p14"), [
    (0.05, 0.95, 0.0, 1.0, 0.0),        # independent loss
    (0.02, 0.25, 0.0, 1.0, 0.0),        # bursts
    (0.03, 0.2, 0.3, 0.5, 0.0),         # good frames inside bursts
    (0.03, 0.2, 0.3, 0.5, 0.08),        # isolated losses
    (0.4, 0.1, 0.8, 0.05, 0.5),
])


def transitions(p13, p31, p32, p23, p14):
    """From row to column: 1 good, 2 good in a burst, 3 lost in a burst, 4 lost alone (Salsano et al. 2009)."""
    return np.array([[1 - p13 - p14, 0, p13, p14],
                     [0, 1 - p23, p23, 0],
                     [p31, p32, 1 - p31 - p32, 0],
                     [1, 0, 0, 0]])


def stationary(P):
    pi, *_ = np.linalg.lstsq(np.vstack([P.T - np.eye(4), np.ones(4)]), np.array([0, 0, 0, 0, 1]), rcond=None)
    return pi


def standard_error(P, pi, f, n):
    """Of the mean of f over n steps: the Markov chain's central limit theorem with its fundamental matrix."""
    f = f - pi @ f
    g = np.linalg.solve(np.eye(4) - P + np.outer(np.ones(4), pi), f)
    return sqrt((pi * f) @ (2 * g - f) / n)


@chains
def test_loss_matches_the_stationary_distribution_of_the_chain(p13, p31, p32, p23, p14, frames):
    channel = FourStateLoss(p13, p31, p32, p23, p14, rng=stream(7, "loss"))
    P = transitions(p13, p31, p32, p23, p14)
    pi, lossy = stationary(P), np.array([0, 0, 1.0, 1.0])

    lost = sum(not list(channel.carry(transit)) for transit in frames(FRAMES))

    assert abs(lost / FRAMES - pi @ lossy) < 4 * standard_error(P, pi, lossy, FRAMES)
    assert pi @ lossy == pytest.approx((p14 + p13 / p31) / (1 + p14 + p13 / p31 * (1 + p32 / p23)), rel=1e-9)


@chains
def test_runs_of_two_and_three_losses_are_as_frequent_as_the_chain_says(p13, p31, p32, p23, p14, frames):
    channel = FourStateLoss(p13, p31, p32, p23, p14, rng=stream(7, "loss"))
    P = transitions(p13, p31, p32, p23, p14)
    pi, L = stationary(P), np.diag([0, 0, 1.0, 1.0])

    lost = np.array([not list(channel.carry(transit)) for transit in frames(FRAMES)])

    for hits, expected in [(lost[1:] & lost[:-1], (pi @ L @ P @ L).sum()),
                           (lost[2:] & lost[1:-1] & lost[:-2], (pi @ L @ P @ L @ P @ L).sum())]:
        batches = hits[:len(hits) // 100 * 100].reshape(100, -1).mean(axis=1)
        assert abs(batches.mean() - expected) < 4 * max(batches.std(ddof=1) / 10, sqrt(expected / FRAMES))


def test_an_isolated_loss_stands_alone(frames):
    channel = FourStateLoss(p13=0.0, p14=0.6, rng=stream(7, "loss"))

    lost = [not list(channel.carry(transit)) for transit in frames(5000)]

    assert any(lost)
    assert not any(second for first, second in pairwise(lost) if first)


def test_p13_alone_is_independent_loss():
    channel = FourStateLoss(0.3, rng=stream(7, "loss"))
    same = FourStateLoss(0.3, 0.7, rng=stream(7, "loss"))

    assert channel._leave_burst == same._leave_burst


@pytest.mark.parametrize(("settings", "message"), [
    ({"p13": 1.2}, "p13=1.2: expected 0 <= p13 <= 1"),
    ({"p13": 0.6, "p14": 0.5}, r"p13=0.6, p14=0.5: expected p13 \+ p14 <= 1"),
    ({"p13": 0.6, "p31": 0.7, "p32": 0.5}, r"expected p31 \+ p32 <= 1"),
    ({"p13": 0.6, "p31": 0.0}, "a burst would never end"),
    ({"p13": 0.1, "p31": 0.5, "p32": 0.1, "p23": 0.0}, "good reception within a burst would never end"),
])
def test_nonsense_is_refused_with_value_and_rule(settings, message):
    with pytest.raises(ValueError, match=message):
        FourStateLoss(**settings, rng=stream(7, "loss"))
