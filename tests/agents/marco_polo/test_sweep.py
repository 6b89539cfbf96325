from itertools import pairwise
from math import asin, inf, pi, sqrt

import numpy as np
import pytest

from agents.marco_polo.c_target import CTarget
from agents.marco_polo.sweep import Sweep, plan_sweep, sweep_probability
from agents.marco_polo.track_line import fit_track

TARGET = CTarget(fit_track([(1.0, 1.0), (2.0, 1.8)]), 1.25, 0.5)
SPEEDS = (0.3, 0.7)
LATTICE = 0.006                 # largest deviation of 4096 points from 65536 points, over the cases below


@pytest.mark.parametrize(("along", "amplitude"), [(0.0, 0.0), (0.5, 0.0), (1.0, 0.375), (4.0, 3.375)])
def test_the_amplitude_keeps_the_field_of_view_within_the_cone(along, amplitude):
    sweep = plan_sweep(TARGET, along, 1.2)

    assert sweep.amplitude_m == pytest.approx(amplitude, abs=1e-12)
    assert sweep.amplitude_m == pytest.approx(max(0.0, 1.25 * 0.5 + along / TARGET.slope - 1.25))


def test_the_maneuver_is_a_triangle_wave_of_constant_speed():
    sweep = Sweep(4.0, 3.0, 1.5)

    assert sweep.period_s == 8.0
    assert [sweep.across_m(t) for t in (0.0, 2.0, 4.0, 6.0, 8.0)] == pytest.approx([0.0, 3.0, 0.0, -3.0, 0.0])
    assert sweep.across_m(1.0) == pytest.approx(1.5)
    assert Sweep(0.5, 0.0, 1.5).across_m(7.0) == 0.0
    assert Sweep(0.5, 0.0, 1.5).period_s == inf


def met(sweep, radius, begin_s, targets, generator):
    """Simulated: which targets come into the field of view, at 4000 instants each."""
    heading, speed = generator.uniform(-pi / 2, pi / 2, targets), generator.uniform(*SPEEDS, targets)
    phase = generator.uniform(0.0, 1.0, targets)
    found = np.zeros(targets, dtype=bool)
    reach = sweep.amplitude_m + radius
    last = np.minimum((sweep.along_m + radius) / (speed * np.cos(heading)), reach / (speed * np.abs(np.sin(heading))))
    for share in (np.arange(4000) + 0.5) / 4000:
        time = begin_s + share * np.maximum(last - begin_s, 0.0)
        turns = (time / sweep.period_s + phase + 0.25) % 1.0 if sweep.amplitude_m else np.full(targets, 0.5)
        sensor = sweep.amplitude_m * (1.0 - 4.0 * np.abs(turns - 0.5)) if sweep.amplitude_m else 0.0
        along, across = speed * time * np.cos(heading), speed * time * np.sin(heading)
        found |= (np.hypot(along - sweep.along_m, across - sensor) <= radius) & (time <= last)
    return found


@pytest.mark.parametrize(("along", "speed", "begin_s"), [
    (1.0, 0.5, 0.0),
    *(pytest.param(*case, marks=pytest.mark.slow) for case in (
        (0.1, 1.2, 4.0), (4.0, 1.2, 8.0), (2.0, 1.2, 0.0), (4.0, 1.2, 0.0), (4.0, 5.0, 0.0), (8.0, 0.5, 0.0)))])
def test_a_simulation_agrees_within_three_standard_errors(along, speed, begin_s):
    targets = 10_000
    sweep = plan_sweep(TARGET, along, speed)

    found = sweep_probability(sweep, 1.25, SPEEDS, begin_s)

    share = float(np.mean(met(sweep, 1.25, begin_s, targets, np.random.default_rng(6))))
    assert abs(found - share) <= 3.0 * sqrt(max(found * (1.0 - found), 1.0 / targets) / targets) + LATTICE


def test_without_amplitude_the_sweep_is_a_sensor_that_stands():
    assert sweep_probability(Sweep(3.0, 0.0, 1.0), 1.25, SPEEDS) == pytest.approx(2.0 * asin(1.25 / 3.0) / pi)
    assert sweep_probability(Sweep(1.0, 0.0, 1.0), 1.25, SPEEDS) == 1.0
    assert sweep_probability(Sweep(3.0, 0.0, 1.0), 1.25, SPEEDS, 1e-9) == pytest.approx(
        2.0 * asin(1.25 / 3.0) / pi, abs=LATTICE)


def test_a_slow_sweep_misses_what_a_fast_one_sees_and_a_late_one_sees_less():
    by_speed = [sweep_probability(plan_sweep(TARGET, 4.0, speed), 1.25, SPEEDS) for speed in (0.1, 0.5, 1.2, 5.0, 50.0)]
    by_begin = [sweep_probability(plan_sweep(TARGET, 4.0, 1.2), 1.25, SPEEDS, at) for at in (0.0, 6.0, 12.0, 40.0)]

    assert all(slower < faster for slower, faster in pairwise(by_speed))
    assert all(early > late for early, late in pairwise(by_begin))
    assert by_begin[-1] == 0.0
    stadium = 2.0 * (np.arctan2(3.375, 4.0) + asin(1.25 / np.hypot(4.0, 3.375))) / pi       # infinitely fast
    assert by_speed[-1] <= stadium + LATTICE
    assert by_speed[-1] > 0.97 * stadium


@pytest.mark.parametrize(("call", "why"), [
    (lambda: plan_sweep(TARGET, -0.1, 1.0), "along_m=-0.1"), (lambda: plan_sweep(TARGET, 1.0, 0.0), "speed_mps=0.0"),
    (lambda: sweep_probability(Sweep(1.0, 1.0, 1.0), 1.0, (0.7, 0.3)), "least and greatest"),
    (lambda: sweep_probability(Sweep(1.0, 1.0, 1.0), 1.0, (0.0, 0.3)), "least and greatest"),
    (lambda: sweep_probability(Sweep(1.0, 1.0, 1.0), 1.0, SPEEDS, -1.0), "begin_s=-1.0")])
def test_a_maneuver_that_is_none_is_refused(call, why):
    with pytest.raises(ValueError, match=why):
        call()
