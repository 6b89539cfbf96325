"""FMUs that take only steps of one size: where they stand, what they hold, and when they take what is set."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.describe_fmu import describe
from fmus.description import PlantDescription
from fmus.fixed_step import FixedStep
from fmus.plant import Plant, PlantEnded, PlantError
from tests.fmus.foreign_fmus import stair, steps

MS = 1_000_000
Make = Callable[..., PlantDescription]


@pytest.fixture(scope="module")
def fixed(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> PlantDescription:
    return describe(steps(tmp_path_factory.mktemp("fixed"), 0.004), cache)


@pytest.fixture
def make(tmp_path: Path, cache: Path) -> Make:
    return lambda *arguments, **keywords: describe(steps(tmp_path, *arguments, **keywords), cache)


@given(st.integers(1, 10**12), st.integers(1, 10**6), st.integers(0, 10**14))
def test_the_last_point_at_or_before_an_instant(numerator: int, denominator: int, t_ns: int) -> None:
    step = FixedStep(numerator + denominator, denominator)

    k = step.points_until(t_ns)

    assert step.instant_ns(k) <= t_ns < step.instant_ns(k + 1)
    exact = k * Fraction(step.numerator, step.denominator)
    assert abs(step.instant_ns(k) - exact) <= Fraction(1, 2)


def test_a_step_of_a_third_of_a_second_meets_every_whole_second() -> None:
    step = FixedStep.of_seconds(1 / 3)

    assert [step.points_until(k * 1_000_000_000) for k in range(86_400)] == [3 * k for k in range(86_400)]


def test_outputs_are_held_between_communication_points(fixed: PlantDescription) -> None:
    with Plant(fixed, "p", {"u": 1.0}) as plant:
        found = []
        for t_ns in (0, 1, 3_999_999, 4 * MS, 5 * MS, 7_999_999, 8 * MS, 20 * MS + 1):
            plant.advance_to(t_ns)
            found.append(plant.get("x"))

        assert found == pytest.approx([0, 0, 0, 0.004, 0.004, 0.004, 0.008, 0.02], abs=1e-15)
        assert plant.now_ns == 20 * MS + 1


@given(st.lists(st.tuples(st.integers(0, 9 * MS), st.none() | st.integers(-5, 5), st.booleans()), max_size=30))
def test_an_input_acts_from_the_first_point_at_or_after_the_instant_of_its_setting(
        fixed: PlantDescription, moves: list[tuple[int, int | None, bool]]) -> None:
    """Oracle: x[k+1] = x[k] + 4 ms u(k), where u(k) was set last at or before k 4 ms."""
    settings: list[tuple[int, float]] = [(0, 0.0)]
    t_ns = 0

    with Plant(fixed, "p") as plant:
        inputs, outputs = plant.input_group(["u"]), plant.output_group(["x"])
        for wait_ns, u, by_group in moves:
            t_ns += wait_ns
            plant.advance_to(t_ns)
            if u is not None:
                settings.append((t_ns, float(u)))
                if by_group:
                    inputs.write([u])
                else:
                    plant.set("u", float(u))
            x = 0.0
            for k in range(t_ns // (4 * MS)):
                x += 0.004 * [value for at_ns, value in settings if at_ns <= k * 4 * MS][-1]
            assert outputs.read()[0] == pytest.approx(x, abs=1e-12)


@pytest.mark.parametrize("named", [True, False])
def test_the_description_or_the_host_says_the_step(named: bool, make: Make) -> None:
    with Plant(make(0.004, named=named), "p", {"u": 1.0}, fixed_step_ns=None if named else 4 * MS) as plant:
        plant.advance_to(11 * MS)

        assert plant.get("x") == pytest.approx(0.008)


def test_a_step_that_nobody_says_is_refused_before_the_first_one(make: Make) -> None:
    with pytest.raises(PlantError, match=r"takes only steps of one size and does not say which .*: give its step"):
        Plant(make(0.004, named=False), "p")


def test_a_model_of_fmi3_with_a_fixed_internal_step_is_stepped_by_multiples_of_it_until_it_ends(
        tmp_path: Path, cache: Path) -> None:
    ends: list[tuple[str, int]] = []
    plant = Plant(describe(stair(tmp_path), cache), "s", on_end=lambda why, t_ns: ends.append((why, t_ns)))
    found = []

    for t_ns in range(0, 500 * MS, 33 * MS):
        plant.advance_to(t_ns)
        found.append(plant.get("stair"))
    with pytest.raises(PlantEnded) as caught:
        plant.advance_to(510 * MS)

    assert found == [t_ns // (20 * MS) * 20 * MS // (100 * MS) for t_ns in range(0, 500 * MS, 33 * MS)]
    assert caught.value.ended_ns == 500 * MS
    assert ends == [(str(caught.value), 510 * MS)]
    with pytest.raises(PlantError, match="the model ended the simulation by itself"):
        plant.get("stair")
    plant.close()


def test_a_discarded_step_ends_a_model_of_fmi2_that_says_terminated(make: Make) -> None:
    plant = Plant(make(stop_s=0.055), "p", {"u": 1.0})
    plant.advance_to(50 * MS)

    with pytest.raises(PlantEnded, match=r"p: the model ended the simulation by itself at t=0\.055 s") as caught:
        plant.advance_to(60 * MS)

    assert caught.value.ended_ns == 55 * MS
    plant.close()
