"""Presets: the ones that come with the models, and what can be wrong with a file of them."""

from __future__ import annotations

from collections.abc import Callable
from math import radians
from pathlib import Path

import pytest

from fmus.build import model_folder, own_models
from fmus.describe import read_model
from fmus.description import PlantDescription
from fmus.plant import Plant, PlantError
from fmus.presets import Preset, read_presets

Own = Callable[..., PlantDescription]


def presets_of(model: str) -> dict[str, Preset]:
    return read_presets(model_folder(model), read_model(model_folder(model) / "variables.toml"))


@pytest.mark.parametrize("model", own_models())
def test_every_preset_that_comes_with_a_model_starts_it(model: str, own: Own) -> None:
    for name, preset in presets_of(model).items():
        with Plant(own(model), name, preset.parameters) as plant:
            plant.advance_to(1_000_000)

            assert {key: plant.get(key) for key in preset.parameters} == preset.parameters


def test_the_pioneer_reaches_its_published_speeds(own: Own) -> None:
    """0.7 m/s straight on, 140 degrees/s on the spot (data sheet)."""
    start = presets_of("unicycle")["p3at"].parameters

    def settled(v: float, omega: float) -> tuple[float, ...]:
        with Plant(own("unicycle"), "p", {**start, "v_cmd": v, "omega_cmd": omega}) as plant:
            plant.advance_to(20_000_000_000)
            return plant.output_group(["v", "omega"]).read()

    assert settled(5.0, 0.0) == pytest.approx((0.7, 0.0), abs=1e-12)
    assert settled(0.0, 9.0) == pytest.approx((0.0, radians(140)), abs=1e-3)        # track given to 1 mm


def test_the_reference_run_has_the_dissertations_pieces() -> None:
    assert presets_of("virtual_reference")["tolic_2012"].parameters == {
        "from_s[1]": 0.0, "from_s[2]": 2.26, "from_s[3]": 9.25, "v_mps[1]": 1.0, "v_mps[2]": 0.6, "v_mps[3]": 2.0,
        "omega_radps[1]": 1.0, "omega_radps[2]": 0.15, "omega_radps[3]": 2.0}


def test_a_model_without_presets_has_none() -> None:
    assert presets_of("wheel_motor") == {}


def test_all_that_is_wrong_with_presets_is_told_at_once(tmp_path: Path) -> None:
    (tmp_path / "presets.toml").write_text("""
[slippery]
parameters = { slip_left = 2.0, slipp = 1.0, v = 1.0, gain_left = "1" }
[lost]
abuot = "x"
""", encoding="utf-8")

    with pytest.raises(PlantError) as caught:
        read_presets(tmp_path, read_model(model_folder("unicycle") / "variables.toml"))

    file = tmp_path / "presets.toml"
    assert str(caught.value).splitlines() == [
        f"{file}: slippery.about: say in a few words what it is",
        f"{file}: slippery.parameters.slip_left=2.0: expected -1 to 1",
        f"{file}: slippery.parameters.slipp: unicycle has no such variable to set",
        f"{file}: slippery.parameters.v: unicycle has no such variable to set",
        f"{file}: slippery.parameters.gain_left='1': expected a number",
        f"{file}: lost: expected a table with about and parameters = {{ variable = value }}",
    ]


def test_presets_that_are_no_toml_name_their_file(tmp_path: Path) -> None:
    (tmp_path / "presets.toml").write_text("[p3at\n", encoding="utf-8")

    with pytest.raises(PlantError, match=r"presets.toml: not valid TOML: .*line 1"):
        read_presets(tmp_path, read_model(model_folder("unicycle") / "variables.toml"))


def test_bounds_of_a_variables_table_reach_the_description_and_are_checked(tmp_path: Path, version: str, own: Own,
                                                                          ) -> None:
    slip = own("unicycle", version).variables["slip_left"]
    (tmp_path / "variables.toml").write_text("""
model = "m"
variable = [{ name = "u", kind = "input", unit = "1", start = 3.0, min = 0, max = 2, about = "a" },
            { name = "w", kind = "input", unit = "1", start = 3.0, min = "0", about = "a" }]
""", encoding="utf-8")

    assert (slip.min, slip.max) == (-1.0, 1.0)
    with pytest.raises(PlantError) as caught:
        read_model(tmp_path / "variables.toml")
    assert [line.split(": ", 1)[1] for line in str(caught.value).splitlines()] == [
        "variable[0].start=3: expected 0 to 2", "variable[1].min='0': expected a finite number"]
