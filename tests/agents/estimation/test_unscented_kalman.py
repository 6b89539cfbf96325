"""Against the exact Kalman filter where the model is linear, against filterpy's unscented filter where it is not."""

from math import nan

import numpy as np
import pytest

from agents.estimation import Inputs
from agents.estimation.unscented_kalman import Tuning, UnscentedKalman

SECOND = 1_000_000_000


def test_a_target_that_stands_still_is_the_scalar_kalman_filter():
    ukf, rng = UnscentedKalman((0.5, -0.5, 0.3), (0.04, 0.09, 0.5)), np.random.default_rng(3)
    mean, variance = np.array([0.5, -0.5]), np.array([0.04, 0.09])

    for k in range(1, 40):
        z = rng.normal(0, 1, 2)
        ukf.correct(k * SECOND, z[0], z[1], Inputs(0.0, 0.0))
        prior = variance + 0.01
        gain = prior / (prior + 0.01)
        mean, variance = mean + gain * (z - mean), (1 - gain) * prior

    assert ukf.mean[:2] == pytest.approx(mean.tolist(), abs=1e-12)
    assert (ukf.covariance[0][0], ukf.covariance[1][1]) == pytest.approx(variance.tolist(), abs=1e-12)
    assert ukf.covariance[0][1] == pytest.approx(0, abs=1e-12)


def test_a_curved_path_is_as_filterpy_has_it():
    kalman = pytest.importorskip("filterpy.kalman", reason="needs filterpy: pip install -e '.[dev]'")
    tuning, rng = Tuning(alpha=0.9, beta=2.0, kappa=0.5), np.random.default_rng(4)
    theirs = kalman.UnscentedKalmanFilter(
        3, 2, 1.0, lambda state: state[:2],
        lambda state, dt, v, omega: state + dt * np.array([v * np.cos(state[2]), v * np.sin(state[2]), omega]),
        kalman.MerweScaledSigmaPoints(3, 0.9, 2.0, 0.5))
    theirs.x, theirs.P = np.array([1.0, 2.0, 0.4]), np.diag([0.01, 0.02, 0.3])
    theirs.Q, theirs.R = 0.01 * np.eye(3), 0.01 * np.eye(2)
    ours = UnscentedKalman((1.0, 2.0, 0.4), (0.01, 0.02, 0.3), 0, Inputs(0.7, 0.2), tuning)
    inputs, t_ns = Inputs(0.7, 0.2), 0

    for _ in range(60):
        gap_ns = int(rng.integers(1, 2 * SECOND))
        t_ns += gap_ns
        theirs.predict(dt=gap_ns * 1e-9, v=inputs.v_mps, omega=inputs.omega_radps)
        expected = theirs.x[:2].copy()
        # Its update uses the points from before Q was added; drawn anew they carry P + Q, as ours do.
        theirs.sigmas_f = theirs.points_fn.sigma_points(theirs.x, theirs.P)
        found = ours.expect(t_ns)
        z = theirs.x[:2] + rng.normal(0, 0.1, 2)
        theirs.update(z)
        inputs = Inputs(*rng.normal(0.3, 0.3, 2))
        ours.correct(t_ns, z[0], z[1], inputs)

        assert found == pytest.approx(expected.tolist(), abs=1e-9)
        assert ours.mean == pytest.approx(theirs.x.tolist(), abs=1e-9)
        assert np.array(ours.covariance) == pytest.approx(theirs.P, abs=1e-9)


def test_a_late_detection_is_left_out_and_one_that_is_none_is_refused():
    ukf = UnscentedKalman((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))
    ukf.correct(2 * SECOND, 1.0, 1.0, Inputs(0.0, 0.0))
    before = ukf.mean, ukf.covariance

    counted = ukf.correct(1 * SECOND, 5.0, 5.0, Inputs(1.0, 1.0))

    assert (counted, (ukf.mean, ukf.covariance)) == (False, before)
    with pytest.raises(ValueError, match="expected finite numbers"):
        ukf.correct(3 * SECOND, nan, 0.0, Inputs(0.0, 0.0))
    with pytest.raises(ValueError, match="with this time stamp already"):
        ukf.correct(2 * SECOND, 0.0, 0.0, Inputs(0.0, 0.0))
    with pytest.raises(ValueError, match="ask in order"):
        ukf.expect(1 * SECOND)


@pytest.mark.parametrize("wrong", [{"variances": (0.0, 1.0, 1.0)}, {"tuning": Tuning(measured_m2=0.0)},
                                   {"tuning": Tuning(kappa=-3.0)}])
def test_what_cannot_be_a_covariance_is_refused(wrong):
    with pytest.raises(ValueError, match="expected"):
        UnscentedKalman(**{"mean": (0.0, 0.0, 0.0), "variances": (1.0, 1.0, 1.0), **wrong})
