"""`plant = { fmu = "unicycle", preset = "p3at", parameters = {...} }`: what is taken from where, and mistakes."""

from __future__ import annotations

import shutil

import pytest

from experiments.scenario import ScenarioError, load
from fmus.build import build_model, model_folder


def with_plant(text, plant):
    return text.replace('{ fmu = "linear_system", parameters_from = "team.models.r1" }', plant)


def test_a_preset_gives_what_the_agent_does_not_say(valid, write):
    path = write(with_plant(valid, '{ fmu = "unicycle", preset = "p3at", parameters = { tau_wheel_s = 0.4, x = 2 } }'))

    assert load(path).agents["r1"].plant.parameters == {
        "wheel_radius_m": 0.11, "track_m": 0.573, "speed_max_mps": 0.7, "accel_max_mps2": 0.3, "tau_wheel_s": 0.4,
        "x": 2}


def test_elements_of_a_preset_are_overridden_one_by_one(valid, write):
    plant = '{ fmu = "virtual_reference", preset = "tolic_2012", parameters = { v_mps = [1.5], "omega_radps[3]" = 1 } }'

    parameters = load(write(with_plant(valid, plant))).agents["r1"].plant.parameters

    assert parameters == {"from_s[1]": 0.0, "from_s[2]": 2.26, "from_s[3]": 9.25, "v_mps[2]": 0.6, "v_mps[3]": 2.0,
                          "omega_radps[1]": 1.0, "omega_radps[2]": 0.15, "v_mps": [1.5], "omega_radps[3]": 1}


def test_a_model_folder_brings_its_presets(valid, write):
    path = write(with_plant(valid, '{ fmu = "my_robot", preset = "rovio" }'))
    shutil.copytree(model_folder("unicycle"), path.parent / "my_robot")

    assert load(path).agents["r1"].plant.parameters["speed_max_mps"] == 0.3


@pytest.mark.parametrize(("plant", "line"), [
    ('fmu = "unicycle", preset = "p3_at"', 'preset="p3_at": no such preset of unicycle; did you mean "p3at"?'),
    ('fmu = "unicycle", preset = "husky"', 'preset="husky": no such preset of unicycle; there are p3at, rovio'),
    ('fmu = "wheel_motor", preset = "p3at"', 'preset="p3at": no such preset of wheel_motor; there are none'),
    ('fmu = "own.fmu", preset = "p3at"', 'preset="p3at": no such preset of own.fmu; there are none'),
    ('fmu = "unicycle", preset = 3', "preset=3: expected text in quotes"),
    ('fmu = "unicycle", preset = "p3at", parameters = { track_m = 0 }',
     "parameters.track_m=0: expected at least 1e-06"),
])
def test_a_preset_or_value_that_does_not_fit_is_refused(plant, line, valid, write):
    path = write(with_plant(valid, f"{{ {plant} }}"))
    shutil.copy(build_model("wheel_motor"), path.parent / "own.fmu")

    with pytest.raises(ScenarioError) as error:
        load(path)

    assert error.value.problems == [f"few.toml: agents.r1.plant.{line}"]


def test_bounds_of_a_foreign_description_are_known_before_the_run(valid, write):
    path = write(with_plant(valid, '{ fmu = "own.fmu", parameters = { slip_left = 1.5 } }'))
    shutil.copy(build_model("unicycle"), path.parent / "own.fmu")

    with pytest.raises(ScenarioError) as error:
        load(path)

    assert error.value.problems == ["few.toml: agents.r1.plant.parameters.slip_left=1.5: expected -1 to 1"]
