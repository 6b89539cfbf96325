"""Process noise of linear_system: its path against a second implementation, its covariance against Van Loan's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from random import Random
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.stats import chi2, kstest

from fmus.description import PlantDescription
from fmus.plant import Plant
from tests.examples import examples
from tests.fmus.reference import exact_step

Own = Callable[..., PlantDescription]
Matrix = NDArray[np.float64]
MS = 1_000_000
INTERVAL_NS = 1 << 20
SPAN_NS = 128 * INTERVAL_NS
SERVO = {"A": [[-1.0, 0.0], [1.0, 0.0]], "B": [[1000.0], [0.0]], "G": [[2.0], [0.0]]}      # of Cervin et al. 2003
COUPLED = {"A": [[-3.0, 40.0], [-20.0, -1.0]], "B": [[1.0], [2.0]], "G": [[0.5, 0.0], [1.0, 0.3]], "x0": [1.0, -1.0]}
UNSTABLE = {"A": [[0.0, 1.0], [30.0, 0.0]], "B": [[0.0], [1.0]], "G": [[0.0], [0.1]]}
CHAIN = {"A": [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]], "G": [[0.0, 0.0], [0.0, 0.0], [0.0, 3.0]]}
PARTLY = {"A": [[-1.0, 0.0], [0.0, -2.0]], "B": [[1.0], [1.0]], "G": [[1.0], [0.0]]}       # one state without noise
STIFF = {"A": [[-1e6, 0.0], [1.0, -1.0]], "G": [[1000.0, 0.0], [0.0, 1.0]]}
SYSTEMS = {"servo": SERVO, "coupled": COUPLED, "unstable": UNSTABLE, "chain": CHAIN, "partly": PARTLY, "stiff": STIFF}


@cache
def van_loan(name: str, h_ns: int) -> tuple[Matrix, Matrix]:
    """exp(A h) and the noise's covariance over h, by the exponential of a block matrix (Van Loan 1978), exactly."""
    a, g = np.array(SYSTEMS[name]["A"]), np.array(SYSTEMS[name]["G"])
    n = len(a)
    block = np.block([[-a, g @ g.T], [np.zeros((n, n)), a.T]]).tolist()
    columns = [exact_step(block, [0.0] * 2 * n, [float(i == k) for i in range(2 * n)], 0.0, h_ns / 1e9)
               for k in range(2 * n)]
    f = [[columns[n + i][n + j] for j in range(n)] for i in range(n)]       # the transpose of the lower right block
    q = [[float(sum(f[i][k] * columns[n + j][k] for k in range(n))) for j in range(n)] for i in range(n)]
    return np.array([[float(each) for each in row] for row in f]), np.array(q)


def normals(seed: int, interval: int, stretch: int, count: int) -> Matrix:
    drawn: list[float] = []
    for block in range(-(-count // 4)):
        counter = stretch + (interval << 64) + (block << 128)
        raw = np.random.Philox(key=seed, counter=(counter - 1) % (1 << 256)).random_raw(4)    # it adds 1 first
        drawn += [NormalDist().inv_cdf(((int(bits) >> 12) + 0.5) * 2.0 ** -52) for bits in raw]
    return np.array(drawn[:count])


def lower(matrix: Matrix, scale: Matrix) -> Matrix:
    """The lower triangle whose square is `matrix`, column after column; what is rounding of `scale` counts as 0."""
    rest, found = matrix.copy(), np.zeros_like(matrix)
    for j in range(len(matrix)):
        if rest[j, j] > 1e-13 * scale[j, j]:
            found[:, j] = rest[:, j] / np.sqrt(rest[j, j])
            rest -= np.outer(found[:, j], found[:, j])
    return found


def end_of_interval(name: str, seed: int, interval: int) -> Matrix:
    _, q = van_loan(name, INTERVAL_NS)
    return lower(q, q) @ normals(seed, interval, 0, len(q))


def noise_at(name: str, seed: int, interval: int, at_ns: int) -> Matrix:
    """The noise since the start of an interval: Gauss' formula for a conditional distribution, halving by halving."""
    whole = end_of_interval(name, seed, interval)
    n = len(whole)
    found, stretch, half_ns, from_ns = np.zeros(n), 1, INTERVAL_NS // 2, 0
    while from_ns != at_ns:
        f, q = van_loan(name, half_ns)
        joint = np.block([[q, q @ f.T], [f @ q, q + f @ q @ f.T]])         # of the first half and the whole
        size = np.sqrt(np.diag(joint)[n:])
        size[size == 0] = 1.0
        inverse = np.linalg.pinv(joint[n:, n:] / np.outer(size, size), rcond=1e-13, hermitian=True)
        gain = joint[:n, n:] / size @ inverse / size
        first = gain @ whole + lower(q - gain @ joint[n:, :n], q) @ normals(seed, interval, stretch, n)
        later = at_ns >= from_ns + half_ns
        if later:
            found, whole, from_ns = f @ found + first, whole - f @ first, from_ns + half_ns
        else:
            whole = first
        stretch, half_ns = 2 * stretch + later, half_ns // 2
    return found


def path(description: PlantDescription, system: dict[str, Any], instants_ns: Sequence[int], seed: int = 1,
         u: float = 0.0) -> Matrix:
    n = len(system["A"])
    with Plant(description, "p", system | {"noise_seed": float(seed), "u[1]": u}) as plant:
        outputs = plant.output_group([f"x[{i + 1}]" for i in range(n)])
        found = []
        for at_ns in instants_ns:
            plant.advance_to(at_ns)
            found.append(outputs.read())
    return np.array(found)


@pytest.mark.parametrize("name", ["servo", "coupled", "unstable", "partly"])
def test_the_path_is_that_of_a_second_implementation(name: str, version: str, own: Own) -> None:
    system, seed = SYSTEMS[name], 2**40 + 17
    a, n = np.array(system["A"]), len(system["A"])
    instants_ns = [1, 1000, 777_777, INTERVAL_NS - 1, INTERVAL_NS, INTERVAL_NS + 7, 3 * INTERVAL_NS, 5 * MS,
                   SPAN_NS - 1, SPAN_NS, 2 * SPAN_NS + 99_999_999]

    seen = path(own("linear_system", version), system, instants_ns, seed)

    x, expected, interval = np.array(system.get("x0", [0.0] * n)), [], 0
    for at_ns in instants_ns:
        while at_ns >= (interval + 1) * INTERVAL_NS:
            x = expm(a * INTERVAL_NS * 1e-9) @ x + end_of_interval(name, seed, interval)
            interval += 1
        since_ns = at_ns - interval * INTERVAL_NS
        expected.append(expm(a * since_ns * 1e-9) @ x + noise_at(name, seed, interval, since_ns))
    np.testing.assert_allclose(seen, np.array(expected), rtol=1e-9, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_path_does_not_depend_on_the_instants_at_which_anybody_looks(name: str, own: Own) -> None:
    """The noise itself is equal to the bit; what is computed without it rounds once for each step, as ever."""
    system, description = SYSTEMS[name], own("linear_system")
    ends_ns = [67 * MS, 300 * MS, 777_777_777]
    rng = Random(3)
    often_ns = sorted({*ends_ns, *(rng.randrange(1, ends_ns[-1]) for _ in range(2_000))})

    seldom = path(description, system, ends_ns, u=1.0)
    often = path(description, system, often_ns, u=1.0)[[often_ns.index(at_ns) for at_ns in ends_ns]]

    size = np.abs(path(description, system, often_ns, u=1.0)).max(axis=0)
    assert (np.abs(seldom - often) <= 2_000 * 4 * np.finfo(float).eps * size.clip(1e-300)).all()
    assert (seldom != path(description, system | {"G": [[0.0]]}, ends_ns, u=1.0)).any()


@pytest.mark.slow
@settings(deadline=None, max_examples=examples(12))
@given(name=st.sampled_from(["servo", "coupled", "unstable", "chain"]),
       instants_ns=st.lists(st.integers(1, 3 * INTERVAL_NS), min_size=2, max_size=2, unique=True).map(sorted))
def test_the_covariance_of_two_instants_is_exact(name: str, instants_ns: list[int], own: Own) -> None:
    """Sample covariance of 400 seeds, standardized by Van Loan's: Wishart, whose trace is chi-squared."""
    system, description, runs = SYSTEMS[name] | {"x0": [0.0]}, own("linear_system"), 400
    n = len(system["A"])
    _, q1 = van_loan(name, instants_ns[0])
    f2, q2 = van_loan(name, instants_ns[1] - instants_ns[0])
    exact = np.block([[q1, q1 @ f2.T], [f2 @ q1, f2 @ q1 @ f2.T + q2]])

    seen = np.array([path(description, system, instants_ns, seed).ravel() for seed in range(runs)])

    scale = np.sqrt(np.diag(exact))
    values, vectors = np.linalg.eigh(exact / np.outer(scale, scale))
    kept = values > 1e-6                    # beyond it rounding of `exact` decides
    z = (seen / scale) @ vectors[:, kept] / np.sqrt(values[kept])
    low, high = chi2.ppf([1e-6, 1 - 1e-6], runs * int(kept.sum()))
    assert low < (z ** 2).sum() < high
    correlation = z.T @ z / runs - np.eye(int(kept.sum()))
    assert np.abs(correlation).max() < 6 * np.sqrt(2 / runs)
    assert kept.sum() >= n


def test_increments_of_a_wiener_process_are_normal_whatever_the_step(own: Own) -> None:
    system = {"A": [[0.0]], "G": [[1.0]]}
    for step_ns in (1, 333, 1_000_003, INTERVAL_NS, SPAN_NS):
        steps = 4_000 if step_ns < SPAN_NS else 500
        x = path(own("linear_system"), system, [k * step_ns for k in range(1, steps + 1)], seed=5)[:, 0]
        z = np.diff(x, prepend=0.0) / np.sqrt(step_ns * 1e-9)

        assert kstest(z, "norm").pvalue > 1e-4
        assert abs(np.corrcoef(z[1:], z[:-1])[0, 1]) < 4.5 / np.sqrt(steps)


def test_in_discrete_time_each_sample_adds_its_noise(own: Own) -> None:
    a, g = np.array([[0.9, 0.1], [0.0, 0.8]]), np.array([[0.5, 0.0, 1.0], [0.0, 2.0, 0.0]])
    system = {"A": a.tolist(), "G": g.tolist(), "dt": 0.01}

    seen = path(own("linear_system"), system, [k * 5 * MS for k in range(1, 41)], seed=9)
    seldom = path(own("linear_system"), system, [200 * MS], seed=9)

    x, expected = np.zeros(2), [np.zeros(2)]
    for k in range(20):
        x = a @ x + g @ normals(9, k, 0, 8)[:3]
        expected += [x, x]
    np.testing.assert_allclose(seen, np.array(expected[:40]), rtol=1e-12)
    assert (seldom[0] == seen[-1]).all()


def test_other_seeds_give_other_paths_and_the_same_seed_the_same(own: Own) -> None:
    first, again, other = (path(own("linear_system"), SERVO, [10 * MS], seed) for seed in (1, 1, 2))

    assert (first == again).all()
    assert (first != other).all()
