"""Plants that do not come with marconet: a model folder, a .fmu file, and what can be wrong with one."""

from __future__ import annotations

import shutil

import pytest

from experiments.scenario import ScenarioError, load
from fmus.build import build_model, model_folder

A_ENDS = "A ends with A[8,8]; a larger plant is a model folder of your own or an FMU"


def with_plant(text, plant):
    return text.replace('{ fmu = "linear_system", parameters_from = "team.models.r1" }', plant)


def test_an_fmu_file_is_described_and_its_path_resolved(valid, write):
    path = write(with_plant(valid, '{ fmu = "plants/wheel.fmu", parameters = { R = 2.0, u = 1, omega = 3.0 } }'))
    (path.parent / "plants").mkdir()
    shutil.copy(build_model("wheel_motor"), path.parent / "plants/wheel.fmu")

    plant = load(path).agents["r1"].plant

    assert plant.fmu == str(path.parent / "plants/wheel.fmu")
    assert plant.parameters == {"R": 2.0, "u": 1, "omega": 3.0}


def test_a_model_folder_beside_the_scenario_is_built(valid, write):
    path = write(with_plant(valid, '{ fmu = "my_wheel", parameters = { R = 2.0 } }'))
    shutil.copytree(model_folder("wheel_motor"), path.parent / "my_wheel")

    assert load(path).agents["r1"].plant.fmu.endswith(".fmu")


@pytest.mark.parametrize(("parameters", "line"), [
    ("{ RR = 2.0 }", 'parameters.RR=2.0: no such parameter or start value; did you mean "R"?'),
    ("{ R = true }", "parameters.R=true: expected a number"),
    ("{ R = { a = 1 } }", "parameters.R={ a = 1 }: expected a value or lists of them, no table"),
    ("{ R = [1.0] }", "parameters.R=[1.0]: expected a number"),
])
def test_a_start_value_that_does_not_fit_is_refused(parameters, line, valid, write):
    path = write(with_plant(valid, f'{{ fmu = "wheel_motor", parameters = {parameters} }}'))

    with pytest.raises(ScenarioError) as error:
        load(path)

    assert error.value.problems == [f"few.toml: agents.r1.plant.{line}"]


@pytest.mark.parametrize(("value", "reason"), [
    ("[[[1.0]]]", f"the model has no A[1,1,1]; {A_ENDS}"),
    ("[[" + "1.0, " * 9 + "]]", f"the model has no A[1,9]; {A_ENDS}"),
    ("[]", "an empty list: leave the key out to keep the FMU's start value"),
    ("[[1.0], 2.0]", "its rows differ in length: a matrix is a list of rows of equal length"),
])
def test_a_matrix_that_does_not_fit_is_refused(value, reason, valid, write):
    path = write(with_plant(valid, f'{{ fmu = "linear_system", parameters = {{ A = {value} }} }}'))

    with pytest.raises(ScenarioError) as error:
        load(path)

    assert error.value.problems[0].endswith(f": {reason}")


def test_an_archive_that_is_no_fmu_is_refused(valid, write):
    path = write(with_plant(valid, '{ fmu = "torn.fmu" }'))
    (path.parent / "torn.fmu").write_bytes(build_model("wheel_motor").read_bytes()[:2000])

    with pytest.raises(ScenarioError) as error:
        load(path)

    (line,) = error.value.problems
    assert line.startswith('few.toml: agents.r1.plant.fmu="torn.fmu": ')
    assert "truncated" in line
