"""The virtual reference against arcs in rational arithmetic; how time is cut changes no bit."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from random import Random

import numpy as np
import pytest

from fmus.description import PlantDescription
from fmus.plant import Plant, PlantError
from tests.fmus.reference import PIECES, exact_step

MS = 1_000_000
EPS = np.finfo(float).eps
Own = Callable[..., PlantDescription]
TABLE = {"from_s": [0.0, 2.26, 9.25], "v_mps": [1.0, 0.6, 2.0], "omega_radps": [1.0, 0.15, 2.0]}


def exact_position(pieces: list[tuple[int, float, float]], end_ns: int) -> tuple[Fraction, Fraction]:
    """By the linear system of (x, y, v cos theta, v sin theta) per piece; cos and sin go on without a reset."""
    x, y, cosine, sine = Fraction(0), Fraction(0), Fraction(1), Fraction(0)
    for (since, v, omega), (until, _, _) in pairwise([*pieces, (end_ns, 0.0, 0.0)]):
        h = (min(until, end_ns) - since) / 1e9
        if h <= 0:
            break
        along = [[0.0, 0.0, v, 0.0], [0.0, 0.0, 0.0, v], [0.0, 0.0, 0.0, -omega], [0.0, 0.0, omega, 0.0]]
        state = exact_step(along, [0.0] * 4, [0.0, 0.0, 1.0, 0.0], 0.0, h)
        x, y = x + cosine * state[0] - sine * state[1], y + sine * state[0] + cosine * state[1]
        cosine, sine = cosine * state[2] - sine * state[3], sine * state[2] + cosine * state[3]
    return x, y


@pytest.mark.parametrize("end_ns", [1, 2_259_999_999, 2_260_000_000, 2_260_000_001, 9_250 * MS, 12_000 * MS])
def test_the_printed_run_is_exact(end_ns: int, version: str, own: Own) -> None:
    x, y = exact_position(list(PIECES), end_ns)

    with Plant(own("virtual_reference", version), "p", TABLE) as plant:
        plant.advance_to(end_ns)
        seen = plant.output_group(["x", "y"]).read()

    # angles up to 9 rad round to 9 EPS, on a way of up to 12 m in three arcs
    assert abs(Fraction(seen[0]) - x) <= 3 * 12 * 9 * EPS
    assert abs(Fraction(seen[1]) - y) <= 3 * 12 * 9 * EPS


@pytest.mark.parametrize("seed", range(10))
def test_how_time_is_cut_changes_no_bit(seed: int, own: Own) -> None:
    rng = Random(f"{seed}/cuts")
    cuts = sorted({rng.randrange(1, 12_000 * MS) for _ in range(50)} | {2_260 * MS + rng.randrange(-2, 3)})

    with Plant(own("virtual_reference"), "p", TABLE) as whole, Plant(own("virtual_reference"), "q", TABLE) as cut:
        whole.advance_to(12_000 * MS)
        for t_ns in [*cuts, 12_000 * MS]:
            cut.advance_to(t_ns)

        names = ["x", "y", "theta", "v", "omega"]
        assert cut.output_group(names).read() == whole.output_group(names).read()


def test_inputs_change_at_their_very_instant(own: Own) -> None:
    with Plant(own("virtual_reference"), "p", TABLE) as plant:
        inputs = plant.output_group(["v", "omega"])
        seen = []
        for t_ns in (0, 2_259_999_999, 2_260_000_000, 9_249_999_999, 9_250_000_000, 10**12):
            plant.advance_to(t_ns)
            seen.append(inputs.read())

    assert seen == [(1.0, 1.0), (1.0, 1.0), (0.6, 0.15), (0.6, 0.15), (2.0, 2.0), (2.0, 2.0)]


def test_many_steps_reach_the_instant_of_change_as_exactly_as_one(own: Own) -> None:
    """226 steps of 10 ms do not add up to 2.26 s in floating point; the model counts nanoseconds."""
    assert sum([0.01] * 226) != 2.26

    with Plant(own("virtual_reference"), "p", TABLE) as plant:
        for k in range(1, 226):
            plant.advance_to(k * 10 * MS)
        before = plant.get("v")
        plant.advance_to(2260 * MS)

        assert (before, plant.get("v"), plant.get("theta")) == (1.0, 0.6, 2.26)


def test_it_stands_before_its_first_piece_and_keeps_its_last(own: Own) -> None:
    start = {"from_s": [0.5, 1.0], "v_mps": [1.0, 2.0], "x": 3.0, "theta": math.pi / 2}

    with Plant(own("virtual_reference"), "p", start) as plant:
        pose = plant.output_group(["x", "y", "theta", "v"])
        plant.advance_to(500 * MS - 1)
        assert pose.read() == (3.0, 0.0, math.pi / 2, 0.0)
        plant.advance_to(5000 * MS)

        assert pose.read() == pytest.approx((3.0, 0.5 + 8.0, math.pi / 2, 2.0), rel=4 * EPS)


def test_pieces_may_be_given_in_any_order_and_the_later_of_two_at_one_instant_rules(own: Own) -> None:
    start = {"from_s": [9.25, 0.0, 2.26, 2.26], "v_mps": [2.0, 1.0, 7.0, 0.6], "omega_radps": [2.0, 1.0, 7.0, 0.15]}

    with Plant(own("virtual_reference"), "p", start) as mixed, Plant(own("virtual_reference"), "q", TABLE) as plain:
        for plant in (mixed, plain):
            plant.advance_to(12_000 * MS)

        assert mixed.output_group(["x", "y", "v"]).read() == plain.output_group(["x", "y", "v"]).read()


def test_a_disturbance_adds_to_the_inputs_while_it_is_held(own: Own) -> None:
    """e = (0.5, -1) over [0, 1) s makes a straight line of the first second; the inputs told stay nominal."""
    with Plant(own("virtual_reference"), "p", TABLE | {"e_v": 0.5, "e_omega": -1.0}) as plant:
        disturbance, pose = plant.input_group(["e_v", "e_omega"]), plant.output_group(["x", "y", "theta", "v", "omega"])
        plant.advance_to(300 * MS)
        plant.advance_to(1000 * MS)
        assert pose.read() == (1.5, 0.0, 0.0, 1.0, 1.0)
        disturbance.write((0.0, 0.0))
        plant.advance_to(2000 * MS)

        x, y, theta, *_ = pose.read()
        assert (x, y, theta) == pytest.approx((1.5 + math.sin(1), 1 - math.cos(1), 1.0), rel=8 * EPS)


def test_a_host_with_steps_of_no_whole_nanoseconds_does_not_drift(own_fmu: Callable[..., object]) -> None:
    from fmpy import simulate_fmu

    steps = 700
    rows = simulate_fmu(str(own_fmu("virtual_reference")), step_size=1 / 300, output_interval=1 / 300,
                        stop_time=steps / 300, start_values={"v_mps[1]": 1.0}, output=["x"])

    assert rows[-1][1] == pytest.approx(steps / 300, abs=0.51e-9)       # half a nanosecond at 1 m/s


def test_an_instant_beyond_the_end_of_time_is_refused(own: Own) -> None:
    with pytest.raises(PlantError, match=r"from_s=\[0.0, 5000000000.0\]: from_s\[2\]: expected at most 4e\+09"):
        Plant(own("virtual_reference"), "p", {"from_s": [0.0, 5e9]})
