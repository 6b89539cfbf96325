"""The loader on our own FMUs, FMI 2.0 and 3.0: time, groups, start values, errors that name file, variable and time."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import msgspec
import pytest

from fmus.description import PlantDescription
from fmus.plant import Plant, PlantError

MS = 1_000_000
Own = Callable[..., PlantDescription]
MATRICES = {"A": [[-3, 1], [2, -1]], "B": [[-4], [-4]], "C": [[-4, 1]], "x0": [1, 1]}


@pytest.fixture
def motor(own: Own, version: str) -> PlantDescription:
    return own("wheel_motor", version)


def test_the_plant_is_at_zero_with_its_start_values(motor: PlantDescription) -> None:
    with Plant(motor, "m", {"omega": 3.0, "R": 2}) as plant:
        assert plant.now_ns == 0
        assert plant.output_group(["omega", "R", "k"]).read() == (3.0, 2.0, 0.05)


def test_advancing_to_now_changes_nothing(motor: PlantDescription) -> None:
    with Plant(motor, "m", {"omega": 3.0}) as plant:
        plant.advance_to(0)
        plant.advance_to(5 * MS)
        before = plant.get("omega")
        plant.advance_to(5 * MS)

        assert plant.get("omega") == before
        assert plant.now_ns == 5 * MS


def test_an_input_acts_from_now_on(motor: PlantDescription) -> None:
    tau = 2e-4 * 1.2 / 0.05**2

    with Plant(motor, "m") as plant:
        plant.advance_to(10 * MS)
        plant.set("u", 6.0)
        plant.advance_to(30 * MS)

        assert plant.get("omega") == pytest.approx(6 / 0.05 * (1 - math.exp(-0.02 / tau)), rel=4e-16)


def test_going_back_in_time_is_refused(motor: PlantDescription) -> None:
    with Plant(motor, "m") as plant:
        plant.advance_to(10 * MS)

        with pytest.raises(PlantError, match=r"m at t=0\.01 s: asked for t=0\.009 s: a plant does not go back in time"):
            plant.advance_to(9 * MS)


def test_ten_hours_of_steps_do_not_drift(own: Own) -> None:
    """Adding up 36000 steps in floating point would be off by far more than one unit in the last place."""
    with Plant(own("wheel_motor"), "m") as plant:
        for k in range(1, 36_001):
            plant.advance_to(k * 1_000_000_007)

        assert abs(plant.get("time") - plant.now_ns / 1e9) <= math.ulp(plant.now_ns / 1e9)


def test_a_group_sets_and_reads_in_the_order_of_its_names(own: Own, version: str) -> None:
    with Plant(own("rigid_body", version), "b") as plant:
        plant.input_group(["torque[2]", "thrust"]).write((2.0, 7.0))

        assert plant.output_group(["thrust", "torque[1]", "torque[2]"]).read() == (7.0, 0.0, 2.0)


def test_nested_lists_set_matrices_and_feedthrough_shows_at_once(own: Own, version: str) -> None:
    with Plant(own("linear_system", version), "x", MATRICES | {"D": [[0.5]]}) as plant:
        plant.set("u[1]", 2.0)

        assert plant.get("y[1]") == -4 + 1 + 0.5 * 2.0


def test_parameters_stay_as_they_are_while_the_plant_runs(motor: PlantDescription) -> None:
    with Plant(motor, "m") as plant, pytest.raises(PlantError, match="R is a parameter: only inputs and tunable"):
        plant.set("R", 1.0)


def test_setting_an_output_is_refused(motor: PlantDescription) -> None:
    with Plant(motor, "m") as plant:
        with pytest.raises(PlantError, match="omega is an output: only inputs"):
            plant.set("omega", 1.0)
        with pytest.raises(PlantError, match=r"omega is an output, not an input; inputs are u$"):
            plant.input_group(["omega"])


def test_all_wrong_start_values_are_named_at_once(own: Own, version: str) -> None:
    description = own("linear_system", version)

    with pytest.raises(PlantError) as caught:
        Plant(description, "m", {"A[9,1]": 1.0, "B": [[1], ["fast"]], "x": [1.0], "C": [[math.nan]], "Q": 1})

    lines = str(caught.value).splitlines()
    assert [line.removeprefix(f"{description.file}: ") for line in lines] == [
        "A[9,1]: no such variable; nearest names: A[8,1], A[7,1], A[6,1]",
        "m: start: B=[[1], ['fast']]: B[2,1]: expected a number",
        "m: start: x=[1.0]: x[1]: is an output: it has no start value to set",
        "m: start: C=[[nan]]: C[1,1]: a value must be finite",
        "Q: no such variable; it has u[1], u[2], u[3], u[4], y[1], y[2], y[3], y[4], ...",
    ]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_an_input_that_is_not_finite_is_refused_with_its_name_and_time(motor: PlantDescription, value: float) -> None:
    with Plant(motor, "m") as plant:
        inputs = plant.input_group(["u"])
        plant.advance_to(20 * MS)

        with pytest.raises(PlantError, match=rf"m at t=0\.02 s: u={value}: a value must be finite"):
            inputs.write([value])
        with pytest.raises(PlantError, match=rf"m at t=0\.02 s: u={value}: a value must be finite"):
            plant.set("u", value)


def test_a_number_may_change_the_list_that_it_stands_in(own: Own, version: str) -> None:
    class Odd:
        def __float__(self) -> float:
            values.clear()
            return 2.0

    values: list[Any] = [Odd(), 3.0]
    with Plant(own("rigid_body", version), "b") as plant:
        plant.input_group(["thrust", "torque[1]"]).write(values)

        assert (plant.get("thrust"), plant.get("torque[1]")) == (2.0, 3.0)


@pytest.mark.parametrize("values", [[], [1.0, 2.0], ["1"], [None], 3.0, [10**400]])
def test_a_group_refuses_what_is_not_its_numbers(motor: PlantDescription, values: object) -> None:
    with Plant(motor, "m") as plant, pytest.raises(PlantError, match="u: expected 1 numbers, got"):
        plant.input_group(["u"]).write(values)      # type: ignore[arg-type]


def test_huge_values_are_values_even_where_their_sum_overflows(own: Own, version: str) -> None:
    with Plant(own("rigid_body", version), "b") as plant:
        plant.input_group(["torque[1]", "torque[2]"]).write([1.7e308, 1.7e308])

        assert plant.output_group(["torque[1]", "torque[2]"]).read() == (1.7e308, 1.7e308)


def test_a_step_that_blows_up_is_an_error_of_the_fmu_with_variable_and_time(own: Own, version: str) -> None:
    with Plant(own("linear_system", version), "x", {"A": [[5000.0]], "x0": [1.0]}) as plant:
        plant.advance_to(100 * MS)

        with pytest.raises(PlantError) as caught:
            plant.advance_to(200 * MS)

        assert "x at t=0.1 s: a step of 0.1 s failed with status error; the FMU says: [error] x[1] = inf" \
            in str(caught.value)


def test_a_closed_plant_says_so_instead_of_crashing(motor: PlantDescription) -> None:
    plant = Plant(motor, "m")
    inputs, outputs = plant.input_group(["u"]), plant.output_group(["omega"])
    plant.close()
    plant.close()

    for use in (lambda: inputs.write([1.0]), outputs.read, lambda: plant.advance_to(MS), lambda: plant.get("u"),
                lambda: plant.set("u", 1.0), lambda: plant.output_group(["u"])):
        with pytest.raises(PlantError, match="the plant is closed"):
            use()


def test_two_instances_share_nothing(motor: PlantDescription) -> None:
    with Plant(motor, "a", {"u": 1.0}) as a, Plant(motor, "b") as b:
        a.advance_to(MS)
        b.advance_to(MS)

        assert a.get("omega") > 0
        assert b.get("omega") == 0


def test_the_description_survives_json(motor: PlantDescription) -> None:
    again = msgspec.json.decode(msgspec.json.encode(motor), type=PlantDescription)

    assert again == motor


def test_fmi2_and_fmi3_give_the_same_bits(own: Own) -> None:
    def run(version: str) -> list[tuple[float, ...]]:
        with Plant(own("rigid_body", version), "b") as plant:
            inputs, outputs = plant.input_group(["thrust", "torque[1]"]), plant.output_group(["p[1]", "p[3]", "q[2]"])
            rows = []
            for k in range(1, 200):
                inputs.write((9.81 + math.sin(k), 0.01 * math.cos(k)))
                plant.advance_to(k * 1_234_567)
                rows.append(outputs.read())
            return rows

    assert run("2.0") == run("3.0")
