from __future__ import annotations

from math import exp, sin, sqrt
from random import Random

import pytest

from firmware_sim.autopilot.exposure_clock import SLIP_PPM, ExposureClock
from firmware_sim.autopilot.position_estimator import PositionEstimator

MS = 1_000_000
DT_S, DT_NS = 0.01, 10 * MS
LATE_NS = 25 * MS


def place(t: float) -> float:
    return 0.5 * sin(2 * t) + 0.3 * t


def acceleration(t: float) -> float:
    return -2.0 * sin(2 * t)


def tracked(seconds: float, noise_m: float = 0.0, late_ns: int = LATE_NS, told_ns: int = LATE_NS, bias: float = 0.0,
            seed: int = 0) -> list[float]:
    """Errors of the position at each prediction of the second half, a frame of each coming `late_ns` later."""
    estimator, rng, errors = PositionEstimator(), Random(f"{seed}/frames"), []
    arrivals: list[tuple[int, float]] = []
    for k in range(round(seconds / DT_S)):
        now_ns = k * DT_NS
        middle = acceleration(now_ns / 1e9 - DT_S / 2) + bias
        estimator.predict(now_ns, (middle, 0.0, 0.0), DT_S)
        arrivals.append((now_ns + late_ns, place(now_ns / 1e9) + rng.gauss(0, noise_m)))
        while arrivals and arrivals[0][0] <= now_ns:
            at_ns, seen = arrivals.pop(0)
            assert estimator.correct(at_ns - told_ns, (seen, 0.0, 0.0), now_ns)
        if k * DT_S > seconds / 2:
            errors.append(estimator.position[0] - place(now_ns / 1e9))
    return errors


def test_late_frames_are_compared_with_the_past() -> None:
    in_time, too_late = tracked(8.0), tracked(8.0, told_ns=0)

    assert max(map(abs, in_time)) < 1e-4                        # what the midpoint rule leaves
    assert max(map(abs, too_late)) > 1.3 * 0.025 * 0.5          # 25 ms at speeds up to 1.3 m/s, taken for now


def test_late_frames_leave_what_frames_in_time_and_dead_reckoning_since_would() -> None:
    late, in_time, rng, periods = PositionEstimator(), PositionEstimator(), Random("7/late"), 4
    frames, believed, pushes = [], [], []
    for k in range(200):
        push = (rng.gauss(0, 1), rng.gauss(0, 1), 0.0)
        frame = (rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1))
        for estimator in (late, in_time):
            estimator.predict(k * DT_NS, push, DT_S)
        in_time.correct(k * DT_NS, frame, k * DT_NS)
        frames.append(frame)
        believed.append((in_time.position, in_time.velocity))
        pushes.append(push)
        if k == 0:
            late.correct(0, frame, 0)           # both begin alike
        if k > periods:
            assert late.correct((k - periods) * DT_NS, frames[k - periods], k * DT_NS)
            reckoned = PositionEstimator()
            reckoned.position, reckoned.velocity = believed[k - periods]
            for push in pushes[k - periods + 1:]:
                reckoned.predict(0, push, DT_S)
            assert late.position == pytest.approx(reckoned.position, abs=1e-12)
            assert late.velocity == pytest.approx(reckoned.velocity, abs=1e-12)


def test_noise_is_averaged_as_the_fading_memory_filter_does() -> None:
    """Share of the noise's variance that is left: (1 - theta) (5 + 4 theta + theta^2) / (1 + theta)^3 (Brookner)."""
    theta = exp(-10.0 * DT_S)
    expected = sqrt((1 - theta) * (5 + 4 * theta + theta**2) / (1 + theta) ** 3)

    errors = [each for seed in range(10) for each in tracked(8.0, noise_m=0.01, late_ns=0, told_ns=0, seed=seed)]

    rms = sqrt(sum(each**2 for each in errors) / len(errors))
    # correlated over about 1 / (1 - theta) predictions: 400 independent ones among 4000, so 3.5 % standard error
    assert rms == pytest.approx(0.01 * expected, rel=4 * 0.035)


def test_frames_out_of_order_from_the_future_or_not_finite_change_nothing() -> None:
    estimator = PositionEstimator()
    for k in range(10):
        estimator.predict(k * DT_NS, (0.0, 0.0, 0.0), DT_S)
        assert estimator.correct(k * DT_NS, (1.0, 2.0, 3.0), k * DT_NS)
    before = estimator.position, estimator.velocity, estimator.exposed_ns

    taken = [estimator.correct(exposed_ns, (seen, 0.0, 0.0), 90 * MS) for exposed_ns, seen in
             ((90 * MS, 9.0), (50 * MS, 9.0), (91 * MS, 9.0), (90 * MS + 1, float("nan")), (-(10**18), 9.0))]

    assert taken == [False] * 5
    assert (estimator.position, estimator.velocity, estimator.exposed_ns) == before


def test_after_a_long_silence_the_first_frame_is_believed() -> None:
    estimator = PositionEstimator()
    estimator.correct(0, (0.0, 0.0, 0.0), 0)
    for k in range(100):
        estimator.predict(k * DT_NS, (1.0, 0.0, 0.0), DT_S)

    estimator.correct(980 * MS, (5.0, 0.0, 0.0), 990 * MS)

    assert estimator.position[0] == pytest.approx(5.0 + 1.0 * 0.01)
    assert estimator.velocity[0] == pytest.approx(1.0)


@pytest.mark.parametrize("drift_ppm", [0, 100, -100])
def test_held_up_frames_do_not_move_the_exposures_of_the_others(drift_ppm: int) -> None:
    clock, rng = ExposureClock(), Random("7/delays")

    errors = []
    for k in range(2000):
        stamp_ns = k * DT_NS
        local_ns = stamp_ns + stamp_ns * drift_ppm // 1_000_000 + 12_345_678
        delay_ns = 8 * MS + (rng.randrange(20 * MS) if rng.random() < 0.7 else 0)
        exposed_ns = clock.exposed_ns(stamp_ns, local_ns + delay_ns, 8 * MS)
        assert exposed_ns is not None
        errors.append(exposed_ns - local_ns)

    # between two frames in time the offset slips by at most SLIP_PPM; 40 periods without one have odds of 0.7^40
    assert max(map(abs, errors[50:])) <= (SLIP_PPM + abs(drift_ppm)) * 40 * DT_NS // 1_000_000


def test_a_clock_that_was_stepped_is_believed_after_a_while() -> None:
    clock = ExposureClock()

    errors = [(clock.exposed_ns(k * DT_NS, k * DT_NS + 8 * MS + (500 * MS if k >= 50 else 0), 8 * MS) or 0)
              - k * DT_NS - (500 * MS if k >= 50 else 0) for k in range(100)]

    assert errors[:50] == [0] * 50
    assert max(errors[50:68]) < -490 * MS
    assert errors[70:] == [0] * 30


def test_a_frame_that_is_not_newer_has_no_exposure() -> None:
    clock = ExposureClock()
    clock.exposed_ns(100, 200, 0)

    assert clock.exposed_ns(100, 300, 0) is None
    assert clock.exposed_ns(99, 300, 0) is None
