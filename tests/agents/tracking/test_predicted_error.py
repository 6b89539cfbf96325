from __future__ import annotations

from math import cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from agents.tracking.closed_loop import run
from agents.tracking.controller import Command, Inputs
from agents.tracking.error_dynamics import state_rate
from agents.tracking.noise import Noise
from agents.tracking.predicted_error import LONGEST_NS, PredictedError, PredictedState, largest_error
from agents.tracking.section_4_6 import LENGTH_NS, REFERENCE, START
from netem.core.random_streams import stream

MS = 1_000_000
small = st.floats(-0.15, 0.15)


def noise(seed, measured=0.15, inputs=0.3):
    return Noise(stream(seed, "tracking/measuring"), stream(seed, "tracking/driving"), measured, inputs)


def test_the_prediction_is_the_integral_of_4_3():
    x, inputs, commands = (1.0, -0.5, 0.7), Inputs(0.8, -0.4), [Command(1.1, 0.6), Command(0.2, -2.0)]
    predicted = PredictedState(x, inputs)

    for command in commands:
        found = predicted.advance(command, 0.37)
        x = solve_ivp(lambda t, y, u=command: state_rate(tuple(y), u, inputs), (0, 0.37), x, rtol=1e-11,
                      atol=1e-12).y[:, -1]

        np.testing.assert_allclose(found, x, atol=1e-9)


@given(nu=st.tuples(small, small, small), v=st.floats(-3, 3), omega=st.floats(-3, 3), e_v=st.floats(-0.3, 0.3),
       e_omega=st.floats(-0.3, 0.3), turn=st.floats(-4, 4), tau_s=st.floats(0, 1.5))
def test_no_noise_and_no_error_of_the_inputs_exceed_the_bound(nu, v, omega, e_v, e_omega, turn, tau_s):
    """R2 drives constant inputs that differ from those told; R1 any command, which the model knows."""
    x, command = (0.4, -0.3, 0.2), Command(0.9, turn)
    measured = (x[0] + nu[0], x[1] + nu[1], x[2] + nu[2])

    believed = PredictedState(measured, Inputs(v, omega)).advance(command, tau_s)
    true = PredictedState(x, Inputs(v - e_v, omega - e_omega)).advance(command, tau_s)

    error = hypot(*(b - t for b, t in zip(believed, true, strict=True)))
    assert error <= largest_error(v, 0.15, 0.3, tau_s) * (1 + 1e-12) + 1e-12


def test_the_bound_is_nearly_attained():
    """Heading error and speed error pull the same way for a while: the bound is no more than a quarter too large."""
    nu, tau_s = 0.15, 0.5
    inputs, real = Inputs(1.0, 0.0), Inputs(0.7, -0.3)
    errors = []
    for theta in np.linspace(-pi, pi, 73):
        offset = nu * np.sqrt(2) * np.array([cos(theta), sin(theta)])
        believed = PredictedState((offset[0], offset[1], nu), inputs).advance(Command(0.0, 0.0), tau_s)
        true = PredictedState((0.0, 0.0, 0.0), real).advance(Command(0.0, 0.0), tau_s)
        errors.append(hypot(*(b - t for b, t in zip(believed, true, strict=True))))

    assert 0.75 * largest_error(1.0, nu, 0.3, tau_s) < max(errors) <= largest_error(1.0, nu, 0.3, tau_s)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("tolerance", [0.3, 0.4, 0.6])
def test_in_the_run_of_section_4_6_the_error_stays_below_the_tolerance(seed, tolerance):
    found = run(PredictedError(tolerance), REFERENCE, START, LENGTH_NS, noise=noise(seed), predict_ns=10 * MS)

    errors = [hypot(*sample.e) for sample in found.samples]
    assert 0.15 < max(errors) <= tolerance
    assert found.rms(10_000 * MS, 12_000 * MS) < 0.35
    assert len(found.transmissions) < 200


def test_without_noise_and_disturbance_one_look_for_each_announcement_is_enough():
    found = run(PredictedError(1e-3, 0.0, 0.0), REFERENCE, START, LENGTH_NS, predict_ns=10 * MS)

    assert [sent.t_ns for sent in found.transmissions] == [0, 2_260 * MS, 9_250 * MS]
    assert max(hypot(*sample.e) for sample in found.samples) < 1e-7
    assert found.rms(11_000 * MS, 12_000 * MS) < 0.01


def test_holding_a_measurement_as_long_diverges():
    """The looks of the model-based run, every 196 ms and more, are too rare for a measurement that is held."""
    sparse = PredictedError(0.4)

    held = run(sparse, REFERENCE, START, LENGTH_NS, noise=noise(1))
    predicted = run(sparse, REFERENCE, START, LENGTH_NS, noise=noise(1), predict_ns=10 * MS)

    assert len(held.transmissions) == len(predicted.transmissions) == 51
    assert max(hypot(*sample.e) for sample in held.samples) > 1.0


def test_intervals_do_not_depend_on_the_state_and_shrink_with_the_speed():
    policy = PredictedError(0.4)
    near, far = policy.decide(5, (0.0, 0.0, 0.0), Inputs(1.0, 1.0)), policy.decide(5, (9.0, 9.0, 3.0), Inputs(1.0, 1.0))
    fast = policy.decide(5, (0.0, 0.0, 0.0), Inputs(2.0, 1.0))

    assert near == far
    assert policy.look(9, (1.0, 1.0, 1.0)) == fast
    assert fast.interval_ns < near.interval_ns
    assert largest_error(1.0, 0.15, 0.3, near.interval_ns * 1e-9) == pytest.approx(0.4, abs=1e-8)
    assert near.gain_product(near.holds_until_ns) < 0.01
    assert PredictedError(1.0, 0.0, 0.0).decide(0, (0.0, 0.0, 0.0), Inputs(1.0, 1.0)).interval_ns == LONGEST_NS - 1


@pytest.mark.parametrize(("settings", "said"), [
    ((0.25,), r"tolerance=0\.25: a measurement alone may be 0\.259808 off, expected more"),
    ((0.5, -0.1), r"noise=-0\.1"), ((0.5, 0.1, float("nan")), "input_error=nan")])
def test_what_cannot_be_is_refused(settings, said):
    with pytest.raises(ValueError, match=said):
        PredictedError(*settings)
    with pytest.raises(ValueError, match="no tracking error"):
        PredictedError(0.5).decide(0, (float("nan"), 0.0, 0.0), Inputs(1.0, 1.0))
    with pytest.raises(ValueError, match=r"predict_ns=-1: expected 0"):
        run(PredictedError(0.5), REFERENCE, START, 1000, predict_ns=-1)
