"""The unicycle against exact arcs in rational arithmetic, Fresnel and sine integrals, and SciPy's solver."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from random import Random

import numpy as np
import pytest
from scipy.special import fresnel, sici

from fmus.description import PlantDescription
from fmus.plant import Plant, PlantError
from tests.fmus.reference import DRIVE, exact_step, unicycle_at

MS = 1_000_000
EPS = np.finfo(float).eps
GAUSS = 5e-15                   # model.c: error of x and y as a share of the way that the wheels can cover
POSE = ("x", "y", "theta")
STATES = (*POSE, "wheel_left", "wheel_right", "angle_left", "angle_right")
Own = Callable[..., PlantDescription]


@pytest.fixture
def drive(own: Own) -> Callable[..., np.ndarray]:
    """States after driving from `start` to each of `instants_ns`."""
    def states(start: Mapping[str, float], *instants_ns: int) -> np.ndarray:
        with Plant(own("unicycle"), "p", start) as plant:
            outputs = plant.output_group(STATES)
            rows = []
            for t_ns in instants_ns:
                plant.advance_to(t_ns)
                rows.append(outputs.read())
        return np.array(rows[-1] if len(rows) == 1 else rows)

    return states


# --- constant wheel speeds


@pytest.mark.parametrize("omega", [0.0, 2.0**-60, 2.0**-30, -(2.0**-10), 0.75, -3.0, 40.0])
@pytest.mark.parametrize("h_ns", [1, MS, 2_260 * MS])
def test_an_ideal_drive_follows_its_commands_on_an_exact_arc(omega: float, h_ns: int, drive: Callable[..., np.ndarray],
                                                             ) -> None:
    """v = 1.5; with r = 0.5 and a track of 2 the commands of the wheels, (v -+ omega) / r, hardly round."""
    h, v, theta = h_ns / 1e9, 1.5, 0.3
    along = [[0.0, 0.0, v, 0.0], [0.0, 0.0, 0.0, v], [0.0, 0.0, 0.0, -omega], [0.0, 0.0, omega, 0.0]]
    exact = exact_step(along, [0.0] * 4, [0.0, 0.0, math.cos(theta), math.sin(theta)], 0.0, h)

    x, y, turned, *_ = drive({"v_cmd": v, "omega_cmd": omega, "wheel_radius_m": 0.5, "track_m": 2.0, "theta": theta},
                             h_ns)

    # theta: rounding of its start, of omega h, and of both wheels' way v h before they are subtracted
    heading = EPS * (abs(theta) + 2 * abs(omega) * h + 2 * v * h / 2.0)
    assert abs(turned - (theta + omega * h)) <= heading + EPS * abs(turned)
    bound = v * h * (8 * EPS + heading)             # a handful of products in a direction that errs so much
    assert abs(Fraction(x) - exact[0]) <= bound
    assert abs(Fraction(y) - exact[1]) <= bound


def test_an_ideal_drive_is_at_its_commanded_speed_as_soon_as_it_is_told(own: Own) -> None:
    with Plant(own("unicycle"), "p", {"wheel_left": 3.0}) as plant:
        commands, speeds = plant.input_group(["v_cmd", "omega_cmd"]), plant.output_group(["v", "omega", "wheel_right"])
        commands.write((0.6, 0.15))

        assert speeds.read() == pytest.approx((0.6, 0.15, (0.6 + 0.15 * 0.25) / 0.1), rel=4 * EPS)
        plant.advance_to(MS)
        commands.write((0.0, 0.0))

        assert speeds.read() == (0.0, 0.0, 0.0)


def test_commands_of_wheels_and_body_add_up(drive: Callable[..., np.ndarray]) -> None:
    both = drive({"u_left": 1.0, "u_right": 2.0, "v_cmd": 0.3, "omega_cmd": 0.2}, 700 * MS)
    wheels = drive({"u_left": 1.0 + 3.0 - 0.5, "u_right": 2.0 + 3.0 + 0.5}, 700 * MS)

    np.testing.assert_allclose(both, wheels, rtol=8 * EPS)


# --- changing wheel speeds


def test_a_ramp_of_the_turn_rate_draws_a_clothoid(drive: Callable[..., np.ndarray]) -> None:
    """Left and right change by the same amount in opposite directions: v is constant, omega = omega0 + alpha t."""
    r, track, accel, h = 0.1, 0.5, 0.4, 2.0
    start = {"wheel_left": 2.0, "wheel_right": 6.0, "u_left": 60.0, "u_right": -60.0, "accel_max_mps2": accel,
             "wheel_radius_m": r, "track_m": track, "theta": 0.2}
    v, omega0, alpha = r * 4.0, r * 4.0 / track, -2 * accel / track

    x, y, theta, *_ = drive(start, round(h * 1e9))

    # theta(t) = theta0 + omega0 t + alpha t^2 / 2 = vertex + alpha (t - t0)^2 / 2 with t0 = -omega0 / alpha
    t0, scale = -omega0 / alpha, math.sqrt(abs(alpha) / math.pi)
    vertex = 0.2 - omega0**2 / (2 * alpha)
    sine, cosine = np.diff(fresnel(np.array([-t0, h - t0]) * scale))[:, 0] / scale
    path = v * np.exp(1j * vertex) * (cosine - 1j * sine)           # alpha < 0
    assert theta == pytest.approx(0.2 + omega0 * h + alpha * h * h / 2, abs=8 * EPS)
    assert complex(x, y) == pytest.approx(path, abs=GAUSS * r * 8 * h + 32 * EPS)


def test_a_turn_that_dies_away_ends_in_sine_and_cosine_integrals(drive: Callable[..., np.ndarray]) -> None:
    """Both wheels tend to one speed from opposite sides: theta = theta_end - swing exp(-t / tau), v constant."""
    r, track, tau, h = 0.1, 0.5, 0.3, 1.7
    start = {"wheel_left": 2.0, "wheel_right": 8.0, "u_left": 5.0, "u_right": 5.0, "tau_wheel_s": tau}
    v, swing = 0.5, r * 6.0 / track * tau

    x, y, theta, *_ = drive(start, round(h * 1e9))

    left = swing * math.exp(-h / tau)       # s = swing exp(-t / tau) runs from swing to left, dt = -tau ds / s
    sines, cosines = sici(np.array([left, swing]))
    path = v * tau * np.exp(1j * swing) * (cosines[1] - cosines[0] - 1j * (sines[1] - sines[0]))
    assert theta == pytest.approx(swing - left, abs=8 * EPS)
    assert complex(x, y) == pytest.approx(path, abs=GAUSS * r * 8 * h + 64 * EPS)


@pytest.mark.parametrize("seed", range(8))
def test_any_drive_agrees_with_scipys_solver(seed: int, drive: Callable[..., np.ndarray]) -> None:
    rng = Random(seed)
    u = rng.uniform(-15, 15), rng.uniform(-15, 15)
    parameters = {**DRIVE, "tau_wheel_s": rng.choice([0.03, 0.2, 1.5]), "slip_left": rng.uniform(-0.3, 0.6),
                  "accel_max_mps2": rng.choice([0.0, 0.4, 2.0]), "speed_max_mps": rng.choice([0.0, 0.7]),
                  "icr_x_m": rng.uniform(-0.1, 0.1)}
    first = [0.5, -0.7, 1.1, rng.uniform(-6, 6), rng.uniform(-6, 6), 10.0, -20.0]

    expected = unicycle_at(parameters, np.array(first), u, 1.3)
    seen = drive({**parameters, **dict(zip(STATES, first, strict=True)), "u_left": u[0], "u_right": u[1]}, 1300 * MS)

    np.testing.assert_allclose(seen, expected, rtol=1e-11, atol=1e-11)      # DOP853 at 1e-12 in each of its steps


@pytest.mark.parametrize("side", ["left", "right"])
def test_one_wheel_that_changes_alone_is_followed_as_closely(side: str, drive: Callable[..., np.ndarray]) -> None:
    """The other one is at its goal, the track so wide that the lag alone asks for short parts."""
    parameters = {**DRIVE, "track_m": 40.0, "tau_wheel_s": 0.05, "accel_max_mps2": 0.0}
    first = [0.0, 0.0, 0.7, *((2.0, 5.5) if side == "left" else (4.5, 2.0)), 0.0, 0.0]
    u = 5.0, 5.0                                        # times the gains 0.9 and 1.1

    expected = unicycle_at(parameters, np.array(first), u, 1.7)
    seen = drive({**parameters, **dict(zip(STATES, first, strict=True)), "u_left": u[0], "u_right": u[1]}, 1700 * MS)

    np.testing.assert_allclose(seen, expected, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("seed", range(12))
def test_how_a_step_is_cut_changes_rounding_only(seed: int, drive: Callable[..., np.ndarray]) -> None:
    rng = Random(f"{seed}/cuts")
    start = {**DRIVE, "u_left": rng.uniform(-15, 15), "u_right": rng.uniform(-15, 15), "wheel_left": rng.uniform(-6, 6),
             "tau_wheel_s": rng.choice([0.0, 1e-4, 0.05, 0.4]), "accel_max_mps2": rng.choice([0.0, 0.5, 3.0])}
    end_ns = 1500 * MS
    cuts = sorted(rng.randrange(1, end_ns) for _ in range(rng.choice([1, 1, 7, 40])))

    whole, parts = drive(start, end_ns), drive(start, *cuts, end_ns)[-1]

    way = 0.11 * 1.3 * 15 * 1.1 * 1.5                   # r (1 - slip) gain u h at most: both wheels' bound, in m
    rounding = 16 * EPS * (len(cuts) + 1)               # of values of at most a few units, in each step
    np.testing.assert_allclose(parts[:2], whole[:2], rtol=0, atol=2 * GAUSS * way + 4 * rounding)
    np.testing.assert_allclose(parts[2:], whole[2:], rtol=rounding, atol=16 * rounding)


def test_a_wheel_far_faster_than_the_step_costs_nothing_and_stays_right(drive: Callable[..., np.ndarray]) -> None:
    tau, accel = 1e-6, 2.0

    x, _, _, *_ = drive({"v_cmd": 1.0, "tau_wheel_s": tau}, 10_000 * MS)
    ramped, *_ = drive({"v_cmd": 1.0, "tau_wheel_s": tau, "accel_max_mps2": accel}, 10_000 * MS)

    assert x == pytest.approx(10.0 - tau, abs=16 * EPS * 10)
    # 1 / (2 accel) is lost on the ramp, which ends tau before its goal, and tau^2 accel / 2 after it
    assert ramped == pytest.approx(10.0 - 1 / (2 * accel), abs=2 * tau)


# --- limits, slip, encoders


def test_limits_hold_at_every_instant(drive: Callable[..., np.ndarray]) -> None:
    start = {"u_left": -500.0, "u_right": 9.0, "tau_wheel_s": 0.05, "speed_max_mps": 0.7, "accel_max_mps2": 1.5,
             "wheel_radius_m": 0.11}

    rows = drive(start, *(k * 5 * MS for k in range(1, 400)))

    rim = 0.11 * rows[:, 3:5]
    assert np.abs(rim).max() <= 0.7 * (1 + 4 * EPS)
    assert np.abs(np.diff(rim, axis=0)).max() <= 1.5 * 0.005 + 8 * EPS
    assert rim[-1] == pytest.approx([-0.7, 0.7], abs=1e-12)         # 9 rad/s * 0.11 m is beyond the limit too


def test_slip_takes_ground_from_a_wheel_and_nothing_from_its_encoder(drive: Callable[..., np.ndarray]) -> None:
    x, y, theta, _, _, left, right = drive(
        {"u_left": 4.0, "u_right": 4.0, "slip_left": 0.25, "slip_right": 0.25}, 1000 * MS)
    stuck = drive({"u_left": 4.0, "u_right": 4.0, "slip_left": 1.0, "slip_right": 1.0}, 1000 * MS)

    assert (x, y, theta) == (pytest.approx(0.3, rel=4 * EPS), 0.0, 0.0)
    assert (left, right) == (4.0, 4.0)
    assert list(stuck) == [0.0, 0.0, 0.0, 4.0, 4.0, 4.0, 4.0]


def test_a_gain_that_is_off_makes_the_wheel_settle_beside_its_command(drive: Callable[..., np.ndarray]) -> None:
    *_, left, right, _, _ = drive({"u_left": 4.0, "u_right": 4.0, "gain_left": 0.9, "tau_wheel_s": 0.01}, 1000 * MS)

    assert (left, right) == (pytest.approx(3.6, rel=4 * EPS), pytest.approx(4.0, rel=4 * EPS))


def test_a_body_that_skids_turns_about_its_centre_of_rotation(drive: Callable[..., np.ndarray]) -> None:
    """Turning in place, the point icr_x ahead stands still and (x, y) circles around it."""
    ahead = 0.08
    rows = drive({"omega_cmd": 2.0, "icr_x_m": ahead, "x": 1.0, "y": 2.0, "theta": 0.4}, *(k * 70 * MS
                                                                                          for k in range(1, 60)))

    centre = rows[:, 0] + 1j * rows[:, 1] + ahead * np.exp(1j * rows[:, 2])
    np.testing.assert_allclose(centre, (1 + 2j) + ahead * np.exp(0.4j), rtol=0, atol=60 * 4 * EPS * 3)


# --- bad input


@pytest.mark.parametrize(("start", "says"), [
    ({"track_m": 0.0}, "track_m=0.0: expected at least 1e-06"),
    ({"wheel_radius_m": -0.1}, "wheel_radius_m=-0.1: expected at least 1e-06"),
    ({"tau_wheel_s": -1}, "tau_wheel_s=-1: expected at least 0"),
    ({"slip_right": 1.5}, "slip_right=1.5: expected -1 to 1"),
])
def test_a_parameter_out_of_its_range_is_named(start: dict[str, float], says: str, version: str, own: Own) -> None:
    with pytest.raises(PlantError) as caught:
        Plant(own("unicycle", version), "p", start)

    assert str(caught.value).endswith(says)


def test_a_step_that_would_never_end_is_an_error_that_names_the_time(own: Own) -> None:
    with Plant(own("unicycle"), "p", {"u_left": 1e12, "accel_max_mps2": 1e-3}) as plant:
        plant.advance_to(MS)

        with pytest.raises(PlantError, match=r"at t=0.001 s: a step of 1e\+09 s failed .*x = -?nan"):
            plant.advance_to(10**18)


def test_starts_of_states_are_taken(drive: Callable[..., np.ndarray]) -> None:
    given: Sequence[float] = (1.0, 2.0, 3.0, 4.0, 4.0, 6.0, 7.0)
    start = dict(zip(STATES, given, strict=True)) | {"u_left": 4.0, "u_right": 4.0, "tau_wheel_s": 0.1}

    seen = drive(start, 1)

    assert seen == pytest.approx(given, abs=1e-8)           # 1 ns at 0.4 m/s
