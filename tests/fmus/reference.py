"""References for the tests of the models: trajectories by SciPy, written to reference.csv, and exact integer steps.

    python -m tests.fmus.reference

linear_system, wheel_motor, omnidirectional (its commands clipped first): scipy.linalg.expm on their linear equations.
rigid_body: scipy.integrate.solve_ivp, DOP853 with tolerances of 1e-12, on quaternion kinematics written independently.
unicycle, virtual_reference, quadrotor: the same solver on their differential equations, restarted where inputs change.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from fmus.build import MODELS
from fmus.parameters import Nested

Vector = NDArray[np.float64]
Solve = Callable[[Sequence[int], Sequence[tuple[float, ...]]], list[Vector]]

A = [[-3.0, 1.0], [2.0, -1.0]]          # agent 1 of the output synchronization example
B = [[-4.0], [-4.0]]
C = [[-4.0, 1.0]]
D = [[0.5]]

# (A, B, x(0)) of single-input systems that test the exact step: each is difficult in its own way
SYSTEMS: dict[str, tuple[list[list[float]], list[float], list[float]]] = {
    "stable": (A, [-4.0, -4.0], [1.0, 1.0]),
    "oscillating": ([[0.0, 6.25], [-6.25, 0.0]], [0.0, 0.5], [1.0, -2.0]),
    "singular": ([[0.0, 1.0], [0.0, 0.0]], [0.0, 0.1], [0.3, 0.7]),
    "stiff": ([[-1000.0, 0.0], [1.0, -0.001]], [1000.0, 0.0], [0.0, 1.0]),
}


def exact_step(a: list[list[float]], b: list[float], x: list[float], u: float, h: float) -> list[Fraction]:
    """Return x(t + h) of dx/dt = A x + B u, by its Taylor series in fixed-point integers.

    Terms grow up to exp(|A| h) before they fall and rounding errors grow no faster, so 3 |A| h + 300 bits leave 1e-40.
    """
    n, norm_h = len(x), max(sum(map(abs, row)) for row in a) * h
    one = 1 << (300 + int(3 * norm_h))
    A = [[each.as_integer_ratio() for each in row] for row in a]
    drive = [Fraction(each) * Fraction(u) for each in b]
    up, down = h.as_integer_ratio()
    term = [int(Fraction(each) * one) for each in x]
    value, order = list(term), 0
    while order <= 2 * norm_h or any(abs(each) >> 100 for each in term):
        order += 1
        slope = [sum(A[i][j][0] * term[j] // A[i][j][1] for j in range(n)) for i in range(n)]
        if order == 1:
            slope = [each + int(push * one) for each, push in zip(slope, drive, strict=True)]
        term = [each * up // (down * order) for each in slope]
        value = [v + t for v, t in zip(value, term, strict=True)]
    return [Fraction(each, one) for each in value]


@dataclass(frozen=True)
class Case:
    """One reference run: inputs are constant from each instant to the next.

    `solve(instants_ns, inputs)` returns the outputs at each instant, computed with the inputs set at that instant."""

    start: dict[str, Nested]
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    instants_ns: tuple[int, ...]
    inputs: tuple[tuple[float, ...], ...]
    solve: Solve

    def text(self) -> str:
        """Return the text of reference.csv: one row per instant, numbers that read back to the same bits."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(("t_ns", *self.input_names, *self.output_names))
        for t_ns, inputs, outputs in zip(self.instants_ns, self.inputs, self.solve(self.instants_ns, self.inputs),
                                         strict=True):
            writer.writerow((t_ns, *map(repr, inputs), *(repr(float(each)) for each in outputs)))
        return out.getvalue()


def _stepped(start: Vector, step: Callable[[Vector, tuple[float, ...], float], Vector]) -> Solve:
    """Return the solution that goes from each instant to the next by `step(state, inputs, length_s)`."""
    def solve(instants_ns: Sequence[int], inputs: Sequence[tuple[float, ...]]) -> list[Vector]:
        states = [start]
        for (since_ns, until_ns), held in zip(pairwise(instants_ns), inputs, strict=False):
            states.append(step(states[-1], held, (until_ns - since_ns) / 1e9))
        return states

    return solve


def _integrated(slope: Callable[..., Vector], length_s: float, state: Vector, *held: Any) -> Vector:
    return np.asarray(solve_ivp(slope, (0, length_s), state, method="DOP853", rtol=1e-12, atol=1e-12,
                                args=held).y[:, -1])


def _held_linear(a: Vector, b: Vector, x: Vector) -> Solve:
    n, m = b.shape

    def step(state: Vector, u: tuple[float, ...], length_s: float) -> Vector:
        grown = expm(np.block([[a, b], [np.zeros((m, n + m))]]) * length_s)
        return np.asarray(grown[:n, :n] @ state + grown[:n, n:] @ np.array(u))

    return _stepped(x, step)


def _rotation(q: Vector) -> Vector:
    w, x, y, z = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def _spin(omega: Vector) -> Vector:
    """Return the 4x4 matrix S of quaternion kinematics: dq/dt = S q / 2."""
    x, y, z = omega
    return np.array([[0, -x, -y, -z], [x, 0, z, -y], [y, -z, 0, x], [z, y, -x, 0]])


def _rigid_body(m: float, inertia: Vector, g: float) -> Solve:
    def slope(_t: float, state: Vector, u: tuple[float, ...]) -> Vector:
        velocity, q, omega = state[3:6], state[6:10], state[10:]
        force = _rotation(q) @ np.array([0, 0, u[0]]) - np.array([0, 0, m * g])
        turning = (np.array(u[1:]) - np.cross(omega, inertia * omega)) / inertia
        return np.concatenate([velocity, force / m, 0.5 * _spin(omega) @ q, turning])

    return _stepped(np.array([0.0] * 6 + [1.0] + [0.0] * 6),
                    lambda state, u, length_s: _integrated(slope, length_s, state, u))


# parameters of the unicycle's reference, chosen so that each has an effect
DRIVE = {"wheel_radius_m": 0.11, "track_m": 0.573, "tau_wheel_s": 0.1, "gain_left": 0.9, "gain_right": 1.1,
         "slip_left": 0.05, "slip_right": -0.02, "icr_x_m": 0.03, "speed_max_mps": 0.7, "accel_max_mps2": 1.5}


def unicycle_at(p: Mapping[str, float], state: Vector, u: Sequence[float], length_s: float) -> Vector:
    """Return the state after `length_s` with constant `u` = (u_left, u_right); requires tau_wheel_s > 0.

    The state is (x, y, theta, wheel_left, wheel_right, angle_left, angle_right). The solver restarts where a wheel
    leaves its acceleration limit, so that it never steps over that discontinuity of the slope.
    """
    r, tau = p["wheel_radius_m"], p["tau_wheel_s"]
    top, limit = p["speed_max_mps"] / r, p["accel_max_mps2"] / r
    goals = [float(np.clip(gain * each, -top, top)) if top else gain * each
             for gain, each in zip((p["gain_left"], p["gain_right"]), u, strict=True)]

    def excess(wheel: int) -> Callable[..., float]:
        def of(_t: float, state: Vector) -> float:
            return abs(goals[wheel] - float(state[3 + wheel])) - limit * tau

        of.terminal, of.direction = True, -1     # type: ignore[attr-defined]
        return of

    def slope(pulls: Sequence[float], _t: float, state: Vector) -> Vector:
        theta, wheels = state[2], state[3:5]
        left, right = r * (1 - p["slip_left"]) * wheels[0], r * (1 - p["slip_right"]) * wheels[1]
        v, omega = (left + right) / 2, (right - left) / p["track_m"]
        sideways = -p["icr_x_m"] * omega
        pulled = [pull or (goal - speed) / tau for pull, goal, speed in zip(pulls, goals, wheels, strict=True)]
        return np.array([v * np.cos(theta) - sideways * np.sin(theta), v * np.sin(theta) + sideways * np.cos(theta),
                         omega, *pulled, *wheels])

    at_s, free = 0.0, [not limit or excess(wheel)(0, state) <= 0 for wheel in (0, 1)]
    while at_s < length_s:
        pulls = [0.0 if free[wheel] else float(np.sign(goals[wheel] - state[3 + wheel])) * limit for wheel in (0, 1)]
        waiting = [wheel for wheel in (0, 1) if not free[wheel]]
        solution = solve_ivp(partial(slope, pulls), (at_s, length_s), state, method="DOP853", rtol=1e-12, atol=1e-13,
                             events=[excess(wheel) for wheel in waiting])
        at_s, state = float(solution.t[-1]), solution.y[:, -1]
        for wheel, times in zip(waiting, solution.t_events or (), strict=True):
            free[wheel] = times.size > 0
    return state


# parameters of the omnidirectional robot's reference, chosen so that each has an effect
GLIDE = {"tau_s": 0.15, "speed_max_mps": 0.3, "omega_max_radps": 1.0}


def _omnidirectional(instants_ns: Sequence[int], inputs: Sequence[tuple[float, ...]]) -> list[Vector]:
    """Return the state (x, y, theta, v_x, v_y, omega) at each instant; `inputs` are commands, clipped here."""
    lag, one = np.eye(3) / GLIDE["tau_s"], np.eye(3)
    a = np.block([[np.zeros((3, 3)), one], [np.zeros((3, 3)), -lag]])
    let_through = []
    for x, y, omega in inputs:
        speed = float(np.hypot(x, y))
        share = min(1.0, GLIDE["speed_max_mps"] / speed) if speed else 1.0
        let_through.append((share * x, share * y, float(np.clip(omega, -1, 1) * GLIDE["omega_max_radps"])))
    start = np.array([1.0, 2.0, 0.5, 0.1, 0.0, -0.2])
    return _held_linear(a, np.vstack([np.zeros((3, 3)), lag]), start)(instants_ns, let_through)


# parameters of the quadrotor's reference: each has an effect, all moments of inertia differ
AIRFRAME: dict[str, Nested] = {
    "mass": 0.6, "J": [2.3e-3, 2.9e-3, 4.4e-3], "arm": 0.17, "k_thrust": 5.6e-6, "k_moment": 1.4e-7,
    "tau_motor": 0.05, "motor_min": 120.0, "motor_max": 800.0, "drag": [0.15, 0.2, 0.3], "g": 9.81}
FLIGHT: dict[str, Any] = {
    "z": 50.0, "v": [1.0, -2.0, 0.5], "q": [0.9, 0.3, -0.1, 0.3], "omega": [1.0, -0.5, 2.0],
    "motor": [300.0, 400.0, 500.0, 450.0]}


def quadrotor_at(p: Mapping[str, Any], state: Vector, u: Sequence[float], wind: Sequence[float], length_s: float
                 ) -> Vector:
    """Return the state (position, velocity, q, omega, motor) after `length_s` of flight at constant `u` and `wind`."""
    inertia, drag = np.array(p["J"]), np.array(p["drag"])
    goals = np.array([np.clip(each, p["motor_min"], p["motor_max"]) if each > 0 else 0.0 for each in u])
    arms = p["arm"] * np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    spins = np.array([1, -1, 1, -1])        # sign of the moment on the body

    def slope(_t: float, state: Vector) -> Vector:
        velocity, q, omega, motor = state[3:6], state[6:10], state[10:13], state[13:]
        thrusts = p["k_thrust"] * motor**2
        R = _rotation(q)
        force = R @ (np.array([0, 0, thrusts.sum()]) - drag * (R.T @ (velocity - np.array(wind))))
        torque = sum(np.cross(arm, [0, 0, thrust]) for arm, thrust in zip(arms, thrusts, strict=True))
        torque = torque + np.array([0, 0, p["k_moment"] * (spins * motor**2).sum()])
        return np.concatenate([
            velocity, force / p["mass"] - np.array([0, 0, p["g"]]), 0.5 * _spin(omega) @ q,
            (torque - np.cross(omega, inertia * omega)) / inertia, (goals - motor) / p["tau_motor"]])

    return _integrated(slope, length_s, state)


PIECES = ((0, 1.0, 1.0), (2_260_000_000, 0.6, 0.15), (9_250_000_000, 2.0, 2.0))     # Tolic 2012, section 4.6


def _virtual_reference(instants_ns: Sequence[int], inputs: Sequence[tuple[float, ...]]) -> list[Vector]:
    def slope(v: float, omega: float, _t: float, pose: Vector) -> Vector:
        return np.array([v * np.cos(pose[2]), v * np.sin(pose[2]), omega])

    pose, rows = np.array([1.0, -2.0, 0.5]), [np.array([1.0, -2.0, 0.5, 1.0, 1.0])]
    for k in range(1, len(instants_ns)):
        cuts = [instants_ns[k - 1], *(at for at, _, _ in PIECES if instants_ns[k - 1] < at < instants_ns[k]),
                instants_ns[k]]
        for since, until in pairwise(cuts):
            v, omega = next((v, omega) for at, v, omega in reversed(PIECES) if at <= since)
            held = v + inputs[k - 1][0], omega + inputs[k - 1][1]
            pose = _integrated(partial(slope, *held), (until - since) / 1e9, pose)
        rows.append(np.array([*pose, *next((v, omega) for at, v, omega in reversed(PIECES) if at <= instants_ns[k])]))
    return rows


def cases() -> dict[str, Case]:
    ms = 1_000_000
    uneven = (0, 1 * ms, 2 * ms, 2 * ms + 1, 5 * ms, 20 * ms, 100 * ms, 333_333_333, 1000 * ms, 5000 * ms, 13_000 * ms)
    a, b, c, d = (np.array(each) for each in (A, B, C, D))
    R, k, J = 1.2, 0.05, 2e-4
    vector = {name: tuple(f"{name}[{i + 1}]" for i in range(size))
              for name, size in (("torque", 3), ("p", 3), ("v", 3), ("q", 4), ("omega", 3), ("u", 4),
                                    ("wind", 3), ("motor", 4))}
    fine = tuple(range(0, 501 * ms, 20 * ms))
    solve_linear = _held_linear(a, b, np.ones(2))
    attitude = np.array(FLIGHT["q"]) / np.linalg.norm(FLIGHT["q"])
    flight = np.array([0.0, 0.0, FLIGHT["z"], *FLIGHT["v"], *attitude, *FLIGHT["omega"], *FLIGHT["motor"]])
    return {
        "linear_system": Case(
            {"A": A, "B": B, "C": C, "D": D, "x0": [1.0, 1.0]}, ("u[1]",), ("y[1]", "x[1]", "x[2]"), uneven,
            tuple((float(np.sin(3 * i)),) for i in range(len(uneven))),
            lambda instants_ns, inputs: [np.concatenate([c @ x + d @ np.array(u), x]) for x, u in zip(
                solve_linear(instants_ns, inputs), inputs, strict=True)]),
        "wheel_motor": Case(
            {"omega": 5.0}, ("u",), ("omega",), uneven, tuple((float(12 * np.cos(i)),) for i in range(len(uneven))),
            _held_linear(np.array([[-k * k / (R * J)]]), np.array([[k / (R * J)]]), np.array([5.0]))),
        "rigid_body": Case(
            {}, ("thrust", *vector["torque"]), (*vector["p"], *vector["v"], *vector["q"], *vector["omega"]), fine,
            tuple((float(9.81 + np.sin(i)), float(0.05 * np.cos(i)), float(0.04 * np.sin(2 * i)), 0.01)
                  for i in range(len(fine))),
            _rigid_body(1.0, np.array([0.01, 0.012, 0.02]), 9.81)),
        "omnidirectional": Case(
            {**GLIDE, "x": 1.0, "y": 2.0, "theta": 0.5, "v_x": 0.1, "omega": -0.2}, ("v_x_cmd", "v_y_cmd", "omega_cmd"),
            ("x", "y", "theta", "v_x", "v_y", "omega"), uneven,
            tuple((float(0.4 * np.sin(i)), float(0.3 * np.cos(2 * i)), float(1.4 * np.cos(i)))
                  for i in range(len(uneven))), _omnidirectional),
        "unicycle": Case(
            {**DRIVE}, ("u_left", "u_right"),
            ("x", "y", "theta", "wheel_left", "wheel_right", "angle_left", "angle_right"),
            tuple(range(0, 3001 * ms, 150 * ms)),
            tuple((float(8 * np.sin(0.7 * i)), float(6 * np.cos(0.3 * i))) for i in range(21)),
            _stepped(np.zeros(7), partial(unicycle_at, DRIVE))),
        "quadrotor": Case(
            AIRFRAME | FLIGHT | {"q": [each / float(np.linalg.norm(FLIGHT["q"])) for each in FLIGHT["q"]]},
            (*vector["u"], *vector["wind"]),
            ("x", "y", "z", *vector["v"], *vector["q"], *vector["omega"], *vector["motor"]), fine,
            tuple((*(float(500 + 40 * np.sin(i + 2 * k)) for k in range(4)), float(np.sin(i)), 0.5, float(np.cos(i)))
                  for i in range(len(fine))),
            _stepped(flight, lambda state, u, length_s: quadrotor_at(AIRFRAME, state, u[:4], u[4:], length_s))),
        "virtual_reference": Case(
            {"x": 1.0, "y": -2.0, "theta": 0.5, "from_s": [at / 1e9 for at, _, _ in PIECES],
             "v_mps": [v for _, v, _ in PIECES], "omega_radps": [omega for _, _, omega in PIECES]},
            ("e_v", "e_omega"), ("x", "y", "theta", "v", "omega"),
            (0, 1 * ms, 2000 * ms, 2260 * ms, 2260 * ms + 1, 9000 * ms, 9500 * ms, 12_000 * ms),
            tuple((float(0.3 * np.sin(i)), float(0.3 * np.cos(2 * i))) for i in range(8)), _virtual_reference),
    }


def main() -> None:
    for name, case in cases().items():
        (MODELS / name / "reference.csv").write_text(case.text(), encoding="utf-8")


if __name__ == "__main__":
    main()
