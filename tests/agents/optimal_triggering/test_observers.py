"""Observers of the tracking error: better than the measurement alone, exact without noise, back after a kidnapping."""

import numpy as np
import pytest

from agents.optimal_triggering.held_loop import HeldLoop, flow
from agents.optimal_triggering.observers import ParticleObserver, UnscentedObserver
from agents.tracking.controller import Inputs

LOOP = HeldLoop(Inputs(1.0, 1.0))
RUNS = 60
BUILD = {"particle": lambda: ParticleObserver(LOOP, RUNS, np.random.default_rng(1), 400),
         "unscented": lambda: UnscentedObserver(LOOP, RUNS)}
every_observer = pytest.mark.parametrize("name", BUILD)


def errors(observer, looks, tau_s=0.1, kidnapped_at=None):
    """Return the mean squares of x^ - x and y^ - x over the runs at each look."""
    rng, every, held = np.random.default_rng(0), np.arange(RUNS), np.zeros(RUNS)
    x, u, found = np.zeros((3, RUNS)), np.zeros((2, RUNS)), []
    for k in range(looks):
        if k == kidnapped_at:
            x = x + 3.0
        y = x + 0.15 * rng.uniform(-1, 1, (3, RUNS))
        estimate = observer.look(every, y, u, held)
        found.append((((estimate - x) ** 2).sum(axis=0).mean(), ((y - x) ** 2).sum(axis=0).mean()))
        u, held = LOOP.command(estimate), np.full(RUNS, tau_s)
        x = flow(x, u, LOOP.inputs(0.3 * rng.uniform(-1, 1, (2, RUNS))), tau_s)
    return np.array(found)


@every_observer
def test_an_estimate_is_closer_than_the_measurement(name):
    found = errors(BUILD[name](), 20)

    ours, measured = found[5:].mean(axis=0)
    assert ours < 0.5 * measured


@every_observer
def test_a_first_look_is_taken_as_it_is_to_within_the_noise(name):
    y = np.full((3, RUNS), 2.0)

    estimate = BUILD[name]().look(np.arange(RUNS), y, np.zeros((2, RUNS)), np.zeros(RUNS))

    assert np.abs(estimate - y).max() < 0.15 / 3


def test_particles_that_all_die_start_again_around_the_look_and_are_counted():
    observer = BUILD["particle"]()

    found = errors(observer, 20, kidnapped_at=10)

    assert observer.reinitialized >= RUNS
    assert found[10, 0] < 0.1                       # 3 m away in each component a look before
    assert found[15:, 0].mean() < found[15:, 1].mean()


def test_one_particle_is_no_filter():
    with pytest.raises(ValueError, match="particles=1"):
        ParticleObserver(LOOP, 1, np.random.default_rng(0), particles=1)
