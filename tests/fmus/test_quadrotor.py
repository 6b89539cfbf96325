"""The quadrotor against closed forms, conservation laws and SciPy's solver."""

from __future__ import annotations

import math
from collections.abc import Callable
from random import Random
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from fmus.build import MODELS, model_folder
from fmus.describe import read_model
from fmus.description import PlantDescription
from fmus.plant import Plant, PlantError
from fmus.presets import read_presets
from tests.fmus.reference import AIRFRAME, cases, quadrotor_at

MS = 1_000_000
EPS = np.finfo(float).eps
STEP_ERROR = 1e-10      # of one second of lively flight at h_max = 1 ms: measured 8.3e-11, fourth order (below)
VECTORS = {"v": 3, "q": 4, "omega": 3, "motor": 4}
STATES = ("x", "y", "z", *(f"{name}[{i + 1}]" for name, size in VECTORS.items() for i in range(size)))
HUMMINGBIRD = dict(read_presets(model_folder("quadrotor"), read_model(MODELS / "quadrotor/variables.toml"))
                   ["hummingbird"].parameters)
G, M, TAU, K = 9.81, 0.5, 0.05, 5.571652e-6
HOVER = math.sqrt(M * G / (4 * K))
Own = Callable[..., PlantDescription]


class Flight:
    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self._u = plant.input_group([f"u[{i}]" for i in range(1, 5)])
        self._all = plant.output_group(STATES)

    def motors(self, *u: float) -> Flight:
        self._u.write(u if len(u) == 4 else u * 4)
        return self

    def to(self, t_ns: int) -> dict[str, Any]:
        self.plant.advance_to(t_ns)
        values = self._all.read()
        state: dict[str, Any] = {"x": values[0], "y": values[1], "z": values[2], "p": np.array(values[:3])}
        at = 3
        for name, size in VECTORS.items():
            state[name] = np.array(values[at:at + size])
            at += size
        return state


@pytest.fixture
def fly(own: Own) -> Callable[..., Flight]:
    return lambda **start: Flight(Plant(own("quadrotor"), "p", HUMMINGBIRD | start))


def turned(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.asarray(v + 2 * np.cross(q[1:], np.cross(q[1:], v) + q[0] * v))


# --- falling, hovering, motors


@pytest.mark.parametrize("t_ns", [1, 999_999, 137 * MS, 1300 * MS])
def test_it_falls_as_a_body_with_linear_drag_does(t_ns: int, fly: Callable[..., Flight]) -> None:
    c, t = 0.25, t_ns / 1e9

    seen = fly(z=100.0, v=[0.0, 0.0, 3.0], drag=[0.1, 0.1, c]).to(t_ns)

    end, rate = -M * G / c, c / M                           # v = end + (3 - end) exp(-rate t)
    fallen = -math.expm1(-rate * t) / rate
    # RK4 on an exponential: (rate h)^5 / 120 of the speed a step
    error = (rate * 1e-3) ** 4 * rate * t / 120 * 23 + 100 * 1500 * EPS
    assert seen["v"][2] == pytest.approx(end + (3 - end) * math.exp(-rate * t), abs=error)
    assert seen["z"] == pytest.approx(100 + end * t + (3 - end) * fallen, abs=error * max(t, 1))


def test_a_tumbling_body_with_equal_drag_falls_as_one_that_does_not(fly: Callable[..., Flight]) -> None:
    start = {"z": 100.0, "v": [2.0, 0.0, 3.0], "drag": [0.2, 0.2, 0.2]}

    calm, wild = fly(**start).to(900 * MS), fly(**start, omega=[3.0, 4.0, 1.0]).to(900 * MS)

    np.testing.assert_allclose(wild["p"], calm["p"], atol=STEP_ERROR * 100)


def test_it_hovers_where_its_thrust_is_its_weight(fly: Callable[..., Flight]) -> None:
    flight = fly(z=2.0, motor=[HOVER] * 4).motors(HOVER)

    seen = flight.to(10_000 * MS)

    drift = 4 * EPS * G * 10.0**2 / 2                       # rounding of the thrust, for ten seconds
    assert seen["z"] == pytest.approx(2.0, abs=drift + 2000 * EPS)
    assert flight.plant.get("thrust") == pytest.approx(M * G, rel=4 * EPS)
    assert [flight.plant.get(f"force[{i}]") for i in (1, 2, 3)] == pytest.approx([0, 0, G], abs=1e-12)


@pytest.mark.parametrize("motor", range(4))
def test_one_motor_follows_its_command_as_a_first_order_lag_does(motor: int, fly: Callable[..., Flight]) -> None:
    u = [0.0] * 4
    u[motor] = 500.0
    flight = fly(z=20.0).motors(*u)

    seen = [flight.to(t_ns)["motor"] for t_ns in (MS, 50 * MS, 51 * MS, 300 * MS)]

    for values, t in zip(seen, (0.001, 0.05, 0.051, 0.3), strict=True):
        expected = np.zeros(4)
        expected[motor] = -500.0 * math.expm1(-t / TAU)
        np.testing.assert_allclose(values, expected, rtol=16 * EPS)


@pytest.mark.parametrize(("motor", "turns"), [(0, (0, -1, 1)), (1, (1, 0, -1)), (2, (0, 1, 1)), (3, (-1, 0, -1))])
def test_each_rotor_turns_the_body_its_way(motor: int, turns: tuple[int, ...], fly: Callable[..., Flight]) -> None:
    u = [0.0] * 4
    u[motor] = 200.0

    omega = fly(z=20.0, J=[2.32e-3] * 3).motors(*u).to(20 * MS)["omega"]       # equal moments: no gyroscopic coupling

    assert tuple(np.sign(np.where(np.abs(omega) < 1e-12, 0, omega))) == turns
    push = K * 200.0**2 * (0.02 - 2 * TAU * -math.expm1(-0.4) + TAU / 2 * -math.expm1(-0.8))    # integral of w^2
    lever = max(np.abs(omega[:2]) * 2.32e-3)
    assert lever == pytest.approx(0.175 * push, rel=1e-6)
    assert abs(omega[2]) * 2.32e-3 == pytest.approx(1.367836e-7 / K * push, rel=1e-6)


def test_commands_are_kept_between_the_motors_lowest_and_highest_speed_or_off(fly: Callable[..., Flight]) -> None:
    flight = fly(z=500.0).motors(50.0, 5000.0, 0.0, -300.0)

    seen = flight.to(5_000 * MS)["motor"]

    np.testing.assert_allclose(seen, [125.66371, 816.81409, 0.0, 0.0], rtol=4 * EPS)


# --- conservation


def test_a_free_body_keeps_its_angular_momentum_and_energy_and_follows_eulers_equations(
        fly: Callable[..., Flight]) -> None:
    J, first = np.array([2.3e-3, 3.1e-3, 4.7e-3]), np.array([0.1, 6.0, 0.2])     # about the unstable axis

    seen = fly(z=1000.0, J=list(J), omega=list(first), drag=[0.0] * 3).to(4000 * MS)

    exact = solve_ivp(lambda _t, o: -np.cross(o, J * o) / J, (0, 4), first, method="DOP853", rtol=1e-13, atol=1e-14)
    # RK4: (6 rad/s * 1 ms)^4 / 120 of 6 rad/s a second; neighbouring paths part as exp(growth 4 s)
    growth = 6.0 * math.sqrt((J[2] - J[1]) * (J[1] - J[0]) / (J[0] * J[2]))
    error = (6e-3) ** 4 / 120 * 6 * math.exp(growth * 4) / growth
    np.testing.assert_allclose(seen["omega"], exact.y[:, -1], atol=error)
    np.testing.assert_allclose(turned(seen["q"], J * seen["omega"]), J * first, atol=1e-9 * np.linalg.norm(J * first))
    assert (J * seen["omega"] ** 2).sum() == pytest.approx((J * first**2).sum(), rel=1e-9)
    assert abs(np.linalg.norm(seen["q"]) - 1) <= 2 * EPS


def test_energy_is_what_thrust_and_torque_put_in_less_what_drag_takes(fly: Callable[..., Flight]) -> None:
    """Powers integrated by Simpson's rule over samples of the outputs alone."""
    drag, J, arm, kM = np.array([0.15, 0.15, 0.25]), np.array([2.32e-3, 2.32e-3, 4e-3]), 0.175, 1.367836e-7
    flight = fly(z=50.0, v=[1.0, 2.0, 0.0], omega=[0.5, 0.0, 1.0], motor=[400.0] * 4).motors(500., 480., 470., 490.)
    powers, energies = [], []
    for k in range(401):
        s = flight.to(k * MS)
        T = K * s["motor"] ** 2
        body = turned(s["q"] * [1, -1, -1, -1], s["v"])
        torque = np.array([arm * (T[1] - T[3]), arm * (T[2] - T[0]), kM * (s["motor"] ** 2 @ [1, -1, 1, -1])])
        powers.append(T.sum() * body[2] - drag @ body**2 + torque @ s["omega"])
        energies.append(M * (s["v"] @ s["v"]) / 2 + J @ s["omega"] ** 2 / 2 + M * G * s["z"])

    work = (powers[0] + powers[-1] + 4 * sum(powers[1:-1:2]) + 2 * sum(powers[2:-1:2])) * 1e-3 / 3
    assert abs(work) > 0.1
    assert energies[-1] - energies[0] == pytest.approx(work, abs=1e-8)      # Simpson: (h / tau)^4 / 180 of some joules


# --- accuracy


def errors(own: Own, h_max: float) -> float:
    case = cases()["quadrotor"]
    expected = np.loadtxt(MODELS / "quadrotor" / "reference.csv", delimiter=",", skiprows=1)[:, 8:]
    with Plant(own("quadrotor"), "p", case.start | {"h_max": h_max}) as plant:
        inputs, outputs = plant.input_group(case.input_names), plant.output_group(case.output_names)
        seen = []
        for t_ns, values in zip(case.instants_ns, case.inputs, strict=True):
            plant.advance_to(t_ns)
            inputs.write(values)
            seen.append(outputs.read())
    return float(np.abs(np.array(seen) - expected).max())


def test_its_error_is_of_fourth_order(own: Own) -> None:
    coarse, fine = errors(own, 4e-3), errors(own, 2e-3)

    assert math.log2(coarse / fine) == pytest.approx(4, abs=0.05)       # next term: order h, under 5 % here


def test_motors_faster_than_the_step_shorten_it(fly: Callable[..., Flight]) -> None:
    """Simpson's rule, which Runge-Kutta is here, over parts of tau: each errs by at most tau^5 / 2880 times the fourth
    derivative of the lift, which falls from part to part as exp(-1)."""
    tau, rise = 2e-3, 100.0
    climb = fly(z=5.0, drag=[0.0] * 3, motor=[HOVER] * 4, tau_motor=tau, h_max=0.02).motors(HOVER + rise).to(40 * MS)

    goal, gone = HOVER + rise, -rise * -math.expm1(-0.04 / tau)
    squares = goal**2 * 0.04 + 2 * goal * gone * tau + rise**2 * -math.expm1(-0.08 / tau) * tau / 2
    fourth = 4 * K / M * (2 * goal * rise + 16 * rise**2) / tau**4
    bound = tau**5 / 2880 * fourth / (1 - math.exp(-1))
    assert climb["v"][2] == pytest.approx(4 * K / M * squares - G * 0.04, abs=bound)


@pytest.mark.parametrize(("share", "stands"), [(0.999, 1.0), (1.001, 0.0)])
def test_wind_from_below_lifts_it_when_it_carries_more_than_its_weight(share: float, stands: float,
                                                                      fly: Callable[..., Flight]) -> None:
    up = share * M * G / 0.25
    flight = fly(drag=[0.1, 0.1, 0.25], wind=[3.0, 0.0, up])
    assert flight.plant.get("on_ground") == stands

    seen = flight.to(1000 * MS)

    assert flight.plant.get("on_ground") == stands
    rate = 0.25 / M                             # the lift that is left falls with the speed
    climbed = (up - M * G / 0.25) * (1 + math.expm1(-rate) / rate) if not stands else 0.0
    assert seen["z"] == pytest.approx(climbed, abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_how_a_flight_is_cut_into_steps_changes_it_by_less_than_the_steps_error(seed: int, fly: Callable[..., Flight],
                                                                               ) -> None:
    """Take-off, flight and landing lie within."""
    rng = Random(f"{seed}/cuts")
    cuts = sorted(rng.randrange(1, 2000 * MS) for _ in range(rng.choice([1, 5, 200])))
    u = [HOVER * rng.uniform(1.02, 1.08) for _ in range(2)]

    def states(*instants_ns: int) -> np.ndarray:
        flight = fly()
        rows = []
        for t_ns in sorted({*instants_ns, 600 * MS, 2000 * MS}):
            flight.motors(u[0], u[1], u[0], u[1]) if t_ns <= 600 * MS else flight.motors(0.0)
            seen = flight.to(t_ns)
            if t_ns in (600 * MS, 2000 * MS):
                rows.append(np.concatenate([seen[name] for name in ("p", "v", "q", "omega", "motor")]))
        return np.array(rows)

    whole, parts = states(), states(*cuts)

    assert whole[0, 2] > 0
    assert whole[1, 2] == 0
    np.testing.assert_allclose(parts, whole, atol=10 * STEP_ERROR)


@pytest.mark.parametrize("seed", range(3))
def test_any_flight_agrees_with_scipys_solver(seed: int, own: Own) -> None:
    rng = Random(f"{seed}/flight")
    first = np.array([0, 0, 30, *(rng.uniform(-3, 3) for _ in range(3)), 1, 0, 0, 0,
                      *(rng.uniform(-2, 2) for _ in range(3)), *(rng.uniform(200, 600) for _ in range(4))])
    u, wind = [rng.uniform(430, 530) for _ in range(4)], [rng.uniform(-4, 4) for _ in range(3)]
    start = AIRFRAME | dict(zip(STATES, first, strict=True)) | {f"u[{i + 1}]": u[i] for i in range(4)} \
        | {f"wind[{i + 1}]": wind[i] for i in range(3)}

    with Plant(own("quadrotor"), "p", start) as plant:
        plant.advance_to(300 * MS)
        seen = plant.output_group(STATES).read()

    np.testing.assert_allclose(seen, quadrotor_at(AIRFRAME, first, u, wind, 0.3), rtol=0, atol=10 * STEP_ERROR)


# --- the ground


def test_it_stands_still_on_the_ground_whatever_its_motors_and_the_wind_do(fly: Callable[..., Flight]) -> None:
    flight = fly(x=1.0, q=[math.cos(0.6), 0.0, 0.0, math.sin(0.6)], wind=[8.0, 0.0, 0.0])
    flight.motors(800.0, 130.0, 130.0, 300.0)

    seen = flight.to(5_000 * MS)

    assert list(seen["p"]) == [1.0, 0.0, 0.0]
    assert not seen["v"].any()
    assert not seen["omega"].any()
    assert flight.plant.get("heading") == pytest.approx(1.2, abs=4 * EPS)
    assert flight.plant.get("on_ground") == 1.0
    assert flight.plant.get("force[3]") == G


def test_it_lifts_off_when_its_thrust_exceeds_its_weight(fly: Callable[..., Flight]) -> None:
    """Motors rise as u (1 - exp(-t / tau)); until then it stands, from then on the thrust's excess lifts it."""
    u = 1.1 * HOVER
    leaves = -TAU * math.log1p(-1 / 1.1)

    def lift(t: float) -> float:
        return 4 * K * (u * -math.expm1(-t / TAU)) ** 2 / M - G

    flight = fly(drag=[0.0] * 3).motors(u)
    before, after = flight.to(round(leaves * 1e9) - 1000), flight.to(400 * MS)

    assert before["z"] == 0.0
    assert after["v"][2] == pytest.approx(quad(lift, leaves, 0.4, epsabs=1e-13)[0], abs=STEP_ERROR)
    height, _ = quad(lambda t: (0.4 - t) * lift(t), leaves, 0.4, epsabs=1e-13)
    assert after["z"] == pytest.approx(height, abs=STEP_ERROR)


def test_it_never_sinks_and_stays_where_it_lands(fly: Callable[..., Flight]) -> None:
    """A fall from 1 m with drag, tumbling: it touches at the closed form's instant and stands level from then on."""
    c = 0.2
    start = {"z": 1.0, "v": [0.5, 0.0, 0.0], "omega": [1.0, 2.0, 0.5], "drag": [c] * 3}
    end, rate = -M * G / c, c / M
    touches = brentq(lambda t: 1 + end * t - end * -math.expm1(-rate * t) / rate, 0.1, 2, xtol=1e-14)

    flight = fly(**start)
    rows = [flight.to(k * 10 * MS) for k in range(100)]

    landed = next(row for row in rows if row["z"] == 0)
    assert rows.index(landed) == math.ceil(touches * 100)
    assert landed["x"] == pytest.approx(0.5 * -math.expm1(-rate * touches) / rate, abs=10 * STEP_ERROR)
    assert min(row["z"] for row in rows) == 0
    assert not landed["v"].any()
    assert list(rows[-1]["p"]) == list(landed["p"])
    assert abs(landed["q"][1]) + abs(landed["q"][2]) == 0


def test_brakes_that_are_too_late_end_in_a_touch_and_a_new_start(fly: Callable[..., Flight]) -> None:
    flight = fly(z=0.05, v=[0.0, 0.0, -3.0], motor=[700.0] * 4).motors(700.0)

    seen = flight.to(500 * MS)

    assert seen["z"] > 0.5
    assert seen["v"][2] > 3


def test_the_preset_flies_as_published(fly: Callable[..., Flight]) -> None:
    """Hover at 0.5 kg g / 4 = 6.11e-8 N/rpm^2 a rotor, 4480 rpm (Michael et al. 2010)."""
    rpm = HOVER * 60 / (2 * math.pi)

    assert rpm == pytest.approx(math.sqrt(0.5 * 9.81 / 4 / 6.11e-8), rel=1e-6)
    assert HUMMINGBIRD["motor_min"] == pytest.approx(1200 * math.pi / 30, rel=1e-6)
    assert HUMMINGBIRD["motor_max"] == pytest.approx(7800 * math.pi / 30, rel=1e-6)
    assert HUMMINGBIRD["k_moment"] == pytest.approx(1.5e-9 * (30 / math.pi) ** 2, rel=1e-6)


# --- bad input


@pytest.mark.parametrize(("start", "says"), [
    ({"mass": 0.0}, "mass=0.0: expected at least 0.001"),
    ({"z": -1.0}, "z=-1.0: expected at least 0"),
    ({"tau_motor": 0.0}, "tau_motor=0.0: expected at least 0.001"),
    ({"J": [1e-3, 0.0, 1e-3]}, "J[2]: expected at least 1e-09"),
])
def test_a_parameter_out_of_its_range_is_named(start: dict[str, Any], says: str, version: str, own: Own) -> None:
    with pytest.raises(PlantError) as caught:
        Plant(own("quadrotor", version), "p", start)

    assert str(caught.value).endswith(says)


def test_a_flight_beyond_all_bounds_is_an_error_that_names_the_time(fly: Callable[..., Flight]) -> None:
    flight = fly(z=1.0, g=0.0, h_max=1e-6)
    flight.to(MS)

    with pytest.raises(PlantError, match=r"at t=0.001 s: a step of 1e\+09 s failed .*z = -?nan"):
        flight.to(10**18)
