from __future__ import annotations

from pathlib import Path

import pytest

from fmus import catalog
from fmus.plant import PlantError


@pytest.fixture(autouse=True)
def _own_cache(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MARCONET_CACHE", str(cache))


def test_the_list_names_every_model_with_its_counts() -> None:
    assert [(e.name, e.inputs, e.outputs, e.parameters) for e in catalog.models()] == [
        ("linear_system", 4, 12, 153), ("omnidirectional", 3, 6, 3), ("quadrotor", 7, 25, 15), ("rigid_body", 4, 13, 6),
        ("unicycle", 4, 9, 10), ("virtual_reference", 2, 5, 48), ("wheel_motor", 1, 1, 3)]
    assert all(entry.about for entry in catalog.models())


def test_a_plant_is_named_by_model_by_folder_or_by_archive(tmp_path: Path) -> None:
    built = catalog.build("wheel_motor")

    assert catalog.fmu_path("fmus/wheel_motor") == catalog.fmu_path("wheel_motor") == built
    assert catalog.fmu_path(str(built)) == built
    assert catalog.info(built).variables["u"].unit == "V"
    with pytest.raises(PlantError, match="wheel: no such plant: give a path that ends in"):
        catalog.fmu_path("wheel")


def test_every_model_has_its_four_files() -> None:
    from fmus.build import MODELS

    for entry in catalog.models():
        for file in ("README.md", "variables.toml", "model.c", "reference.csv"):
            assert (MODELS / entry.name / file).is_file(), f"{entry.name}/{file}"
