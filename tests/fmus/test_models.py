"""Our models against what they claim: SciPy's trajectories, exact rational arithmetic, and a second FMI host."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from fractions import Fraction
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.build import MODELS, own_models
from fmus.description import PlantDescription
from fmus.plant import Plant
from tests.fmus.reference import SYSTEMS, cases, exact_step

MS = 1_000_000
EPS = np.finfo(float).eps
Own = Callable[..., PlantDescription]

# Largest error against the reference, as a share of the largest value of the column. The linear models: rounding of
# ten steps in each of the two computations, none above 100 EPS. rigid_body: midpoint steps of 2 ms, second order.
# unicycle, virtual_reference: SciPy's own error, 1e-12 in each step, some ten steps of weight.
# quadrotor: Runge-Kutta steps of 1 ms, fourth order (test_quadrotor.py).
SHARE = {"linear_system": 1e3 * EPS, "wheel_motor": 1e3 * EPS, "rigid_body": 1e-5, "unicycle": 1e-11,
         "virtual_reference": 1e-11, "quadrotor": 2e-10, "omnidirectional": 1e3 * EPS}


def reference(model: str) -> np.ndarray:
    return np.loadtxt(MODELS / model / "reference.csv", delimiter=",", skiprows=1)


@pytest.mark.parametrize("model", own_models())
def test_reference_csv_is_what_scipy_computes_today(model: str) -> None:
    written = list(csv.reader((MODELS / model / "reference.csv").read_text().splitlines()))
    computed = list(csv.reader(cases()[model].text().splitlines()))

    assert written[0] == computed[0]
    np.testing.assert_allclose(np.array(written[1:], float), np.array(computed[1:], float), rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("model", own_models())
def test_the_plant_follows_the_reference(model: str, version: str, own: Own) -> None:
    case = cases()[model]
    expected = reference(model)[:, 1 + len(case.input_names):]

    with Plant(own(model, version), "p", case.start) as plant:
        inputs, outputs = plant.input_group(case.input_names), plant.output_group(case.output_names)
        seen = []
        for t_ns, values in zip(case.instants_ns, case.inputs, strict=True):
            plant.advance_to(t_ns)
            inputs.write(values)
            seen.append(outputs.read())

    error = np.abs(np.array(seen) - expected).max(axis=0)
    assert (error <= SHARE[model] * np.abs(expected).max(axis=0).clip(1)).all()


@pytest.mark.parametrize("model", own_models())
def test_fmpy_as_another_host_sees_the_same_trajectory(
        model: str, version: str, own: Own, own_fmu: Callable[..., object]) -> None:
    from fmpy import simulate_fmu

    description, step_ns, steps = own(model, version), 5 * MS, 40
    names = description.names("output")
    start = {"A[1,2]": 1.0, "A[2,1]": -4.0, "B[2,1]": 1.0, "C[1,1]": 1.0, "x0[1]": 1.0} \
        if model == "linear_system" else {}
    first_input = description.names("input")[0]

    with Plant(description, "p", start | {first_input: 3.0}) as plant:
        outputs = plant.output_group(names)
        ours = [outputs.read()]
        for k in range(1, steps + 1):
            plant.advance_to(k * step_ns)
            ours.append(outputs.read())
    theirs = simulate_fmu(str(own_fmu(model, version)), step_size=step_ns / 1e9, output_interval=step_ns / 1e9,
                          stop_time=steps * step_ns / 1e9, start_values=start | {first_input: 3.0}, output=names)

    # FMPy passes differences of k * 0.005 as steps, so its h differs from 5 ms by up to an ulp of 0.2 s
    rates = np.abs(np.diff(np.array(ours), axis=0)).max() / (step_ns / 1e9)
    np.testing.assert_allclose(np.array([list(row)[1:] for row in theirs]), np.array(ours),
                               rtol=1e3 * EPS, atol=steps * math.ulp(0.2) * max(rates, 1))


@pytest.mark.parametrize("h_ns", [1, 1000, 1_085_910, 50 * MS, 1000 * MS, 5000 * MS])
@pytest.mark.parametrize("system", SYSTEMS)
def test_one_step_is_exact_to_rounding(system: str, h_ns: int, own: Own) -> None:
    """One rounding for adding to x, and |A| h of them: the least condition number that the exponential can have."""
    a, b, x = SYSTEMS[system]
    h = h_ns / 1e9
    norm_h = max(sum(map(abs, column)) for column in zip(*a, strict=True)) * h_ns / 1e9
    exact = exact_step(a, b, x, 0.75, h)

    start = {"A": a, "B": [[each] for each in b], "x0": x, "u[1]": 0.75}
    with Plant(own("linear_system"), "p", start) as plant:
        plant.advance_to(h_ns)
        seen = plant.output_group(["x[1]", "x[2]"]).read()

    error = max(abs(Fraction(s) - e) for s, e in zip(seen, exact, strict=True))
    size = max(*map(abs, exact), *map(abs, map(Fraction, x)))
    assert error <= size * EPS * (1 + norm_h)


def test_trailing_zeros_change_nothing(own: Own) -> None:
    """The same two states as states 1-2 of 8, as states 7-8 of 8 (nothing to leave out), give the same bits."""
    a, x0 = [[-3.0, 1.0], [2.0, -1.0]], [1.0, -0.5]

    def run(shift: int) -> list[tuple[float, ...]]:
        start: dict[str, float] = {f"x0[{i + 1 + shift}]": x0[i] for i in range(2)}
        start |= {f"A[{i + 1 + shift},{j + 1 + shift}]": a[i][j] for i in range(2) for j in range(2)}
        start |= {f"B[{i + 1 + shift},{1 + shift // 2}]": -4.0 for i in range(2)}
        with Plant(own("linear_system"), "p", start) as plant:
            outputs = plant.output_group([f"x[{1 + shift}]", f"x[{2 + shift}]"])
            rows = []
            for k in range(1, 50):
                plant.set(f"u[{1 + shift // 2}]", math.sin(k))
                plant.advance_to(k * 1_085_910)
                rows.append(outputs.read())
            return rows

    assert run(0) == run(6)


@given(moves=st.lists(st.tuples(st.integers(0, 70), st.none() | st.integers(-4, 4)), max_size=20))
def test_in_discrete_time_inputs_are_taken_and_outputs_change_at_sample_instants_alone(
        moves: list[tuple[int, int | None]], own: Own) -> None:
    """Oracle: x(k + 1) = A x(k) + B u(k) with u(k) as set last at or before k 20 ms; y(k) is held from then on."""
    a, b, c, d = np.array([[0.5, 0.25], [-1.0, 0.75]]), np.array([1.0, -2.0]), np.array([2.0, 1.0]), 0.5
    start = {"A": a.tolist(), "B": b[:, None].tolist(), "C": [c.tolist()], "D": [[d]], "x0": [1.0, 2.0], "dt": 0.02}
    sets, t_ms = [(0, 0.0)], 0

    with Plant(own("linear_system"), "p", start) as plant:
        for wait_ms, u in moves:
            t_ms += wait_ms
            plant.advance_to(t_ms * 1_000_000)
            if u is not None:
                plant.set("u[1]", float(u))
                sets.append((t_ms, float(u)))
            x = np.array([1.0, 2.0])
            inputs = [[u for at_ms, u in sets if at_ms <= 20 * k][-1] for k in range(t_ms // 20 + 1)]
            for held in inputs[:-1]:
                x = a @ x + b * held
            assert plant.get("y[1]") == pytest.approx(c @ x + d * inputs[-1], rel=1e-12, abs=1e-9)


def test_more_step_sizes_than_an_instance_keeps_still_give_the_right_ones(own: Own) -> None:
    rng, t_ns = Random("7/steps"), 0

    with Plant(own("linear_system"), "p", {"A": [[-2.0]], "x0": [1.0]}) as plant:
        for k in range(400):
            t_ns += [1, 2, 3, 5, 7, 11, 13, 17, 19, 23, 29][rng.randrange(11)] * 100_000
            plant.advance_to(t_ns)

            x = plant.get("x[1]")
            assert x == pytest.approx(math.exp(-2 * t_ns / 1e9), rel=(k + 1) * 2 * EPS)


def test_the_motor_is_exact_at_any_step(own: Own) -> None:
    tau = 2e-4 * 1.2 / 0.05**2

    with Plant(own("wheel_motor"), "m", {"u": 12.0, "omega": -50.0}) as plant:
        plant.advance_to(77 * MS)
        plant.advance_to(3_600_000 * MS)

        assert plant.get("omega") == 240.0
    with Plant(own("wheel_motor"), "m", {"u": 12.0, "omega": -50.0}) as plant:
        plant.advance_to(77 * MS)

        assert plant.get("omega") == pytest.approx(240 - 290 * math.exp(-0.077 / tau), rel=4 * EPS)


def rigid_body_error(own: Own, h_max: float) -> float:
    case = cases()["rigid_body"]
    expected = reference("rigid_body")[-1, 5:]
    with Plant(own("rigid_body"), "b", {"h_max": h_max}) as plant:
        inputs, outputs = plant.input_group(case.input_names), plant.output_group(case.output_names)
        for t_ns, values in zip(case.instants_ns, case.inputs, strict=True):
            plant.advance_to(t_ns)
            inputs.write(values)
        return float(np.abs(np.array(outputs.read()) - expected).max())


def test_the_rigid_body_is_of_second_order(own: Own) -> None:
    coarse, fine = rigid_body_error(own, 0.002), rigid_body_error(own, 0.001)

    assert math.log2(coarse / fine) == pytest.approx(2, abs=0.05)      # next term of the error: order h, under 5 % here


def test_a_free_rigid_body_keeps_its_spin_and_its_quaternion_keeps_its_length(own: Own) -> None:
    J = np.array([0.01, 0.012, 0.02])

    with Plant(own("rigid_body"), "b", {"omega": [1.0, 2.0, 3.0], "g": 0.0, "h_max": 1e-3}) as plant:
        plant.advance_to(2000 * MS)
        q, omega = (np.array(plant.output_group([f"{name}[{i + 1}]" for i in range(size)]).read())
                    for name, size in (("q", 4), ("omega", 3)))

    assert abs(np.linalg.norm(q) - 1) <= 2 * EPS
    w, xyz = q[0], q[1:]

    def turned(v: np.ndarray) -> np.ndarray:
        return v + 2 * np.cross(xyz, np.cross(xyz, v) + w * v)

    # second order: 2000 steps of (1e-3 * |omega|)^3 / 12 relative, |omega| = 3.7
    momentum = J * np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(turned(J * omega), momentum, atol=2000 * (3.7e-3) ** 3 / 12 * np.linalg.norm(momentum))
