from copy import deepcopy
from math import sqrt

import numpy as np
import pytest
from filterpy.monte_carlo import resampling

from agents.estimation import Inputs
from agents.estimation.particle_filter import ParticleFilter

STEP_NS = 70_000_000


def test_a_target_that_stands_still_is_the_kalman_filter_within_the_error_of_the_particles():
    """Noise 0.01 a step, three steps a gap. Few resamplings: their variances add up, at most P / n each here."""
    n, rng = 40_000, np.random.default_rng(5)
    particles = ParticleFilter((0.0, 0.0, 0.0), (0.04, 0.04, 0.1), rng, particles=n)
    mean, variance, updates = np.zeros(2), 0.04, 8

    for k in range(1, updates + 1):
        z = rng.normal(0, 0.2, 2)
        particles.correct(3 * k * STEP_NS, z[0], z[1], Inputs(0.0, 0.0))
        prior = variance + 3 * 0.01
        gain = prior / (prior + 0.01)
        mean, variance = mean + gain * (z - mean), (1 - gain) * prior
        found = particles.expect(3 * k * STEP_NS)

        # prior / variance = prior precision ratio: of n draws from the prior so many count in the posterior, at least
        effective = n * variance / prior * 0.5
        assert np.abs(np.array(found) - mean).max() < 5 * sqrt(variance / effective) * sqrt(k)


def test_particles_move_as_unicycles_and_spread_by_the_noise_of_each_step():
    n, steps = 100_000, 10
    particles = ParticleFilter((1.0, 2.0, 0.5), (0.0, 0.0, 0.0), np.random.default_rng(6), 0, Inputs(0.0, 0.3),
                               particles=n, process_m2=0.04)

    particles.expect(steps * STEP_NS)

    spread = particles.particles.std(axis=1)
    assert spread == pytest.approx([sqrt(steps) * 0.2] * 3, rel=5 / sqrt(2 * n))
    assert abs(particles.particles[2].mean() - (0.5 + 0.3 * 0.7)) < 5 * spread[2] / sqrt(n)


def test_a_part_of_a_step_brings_its_part_of_the_variance():
    n = 100_000
    particles = ParticleFilter((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), np.random.default_rng(6), particles=n, process_m2=0.04)

    particles.expect(STEP_NS // 4)

    assert particles.particles.std(axis=1) == pytest.approx([0.1] * 3, rel=5 / sqrt(2 * n))


def test_without_noise_every_particle_drives_the_same_euler_steps():
    particles = ParticleFilter((0.0, 0.0, 0.2), (0.0, 0.0, 0.0), np.random.default_rng(7), 0, Inputs(0.5, 1.0),
                               particles=3, process_m2=0.0)
    x = y = 0.0
    theta = 0.2
    for _ in range(4):
        x, y, theta = x + 0.07 * 0.5 * np.cos(theta), y + 0.07 * 0.5 * np.sin(theta), theta + 0.07

    found = particles.expect(4 * STEP_NS)

    assert found == pytest.approx((x, y), abs=1e-12)
    assert particles.particles[2] == pytest.approx([theta] * 3, abs=1e-12)


def test_the_same_generator_gives_the_same_estimates():
    def estimates():
        particles = ParticleFilter((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), np.random.default_rng(8))
        particles.correct(STEP_NS, 0.3, 0.1, Inputs(0.2, 0.1))
        return particles.expect(5 * STEP_NS)

    assert estimates() == estimates()


def test_late_detections_are_left_out_and_few_particles_refused():
    particles = ParticleFilter((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), np.random.default_rng(8))
    particles.correct(2 * STEP_NS, 0.0, 0.0, Inputs(0.0, 0.0))

    assert particles.correct(STEP_NS, 9.0, 9.0, Inputs(0.0, 0.0)) is False
    with pytest.raises(ValueError, match="particles=1"):
        ParticleFilter((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), np.random.default_rng(8), particles=1)


def test_a_detection_resamples_as_filterpy_does(monkeypatch):
    """Weights from Bayes' rule, normalized; the one random number of the systematic resampling is the same for both."""
    rng = np.random.default_rng(3)
    particles = ParticleFilter((0.0, 0.0, 0.0), (0.3, 0.3, 0.5), rng, inputs=Inputs(0.5, 0.2))
    particles.expect(STEP_NS)
    before, twin = particles.particles.copy(), deepcopy(rng)
    likelihood = np.exp(-0.5 * ((before[0] - 0.4) ** 2 + (before[1] + 0.2) ** 2) / 0.01)
    monkeypatch.setattr(resampling, "random", twin.random)

    particles.correct(STEP_NS, 0.4, -0.2)

    drawn = resampling.systematic_resample(likelihood / likelihood.sum())
    assert len(set(drawn)) > 50
    assert np.array_equal(particles.particles, before[:, drawn])


def test_where_only_the_last_particle_explains_the_detection_all_are_drawn_from_it():
    particles = ParticleFilter((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), np.random.default_rng(9), particles=5,
                               process_m2=0.0, measured_m2=1e-6)
    last = particles.particles[:, -1].copy()

    particles.correct(0, last[0], last[1])

    assert np.array_equal(particles.particles, np.tile(last[:, None], 5))
    assert particles.expect(0) == pytest.approx((last[0], last[1]), abs=1e-12)


@pytest.mark.parametrize("count", [2, 3, 10, 1000])
def test_of_particles_that_weigh_the_same_each_is_drawn_once(count):
    particles = ParticleFilter((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), np.random.default_rng(9), particles=count,
                               process_m2=0.0)
    headings = particles.particles[2].copy()

    particles.correct(0, 0.0, 0.0)

    assert np.array_equal(particles.particles[2], headings)
