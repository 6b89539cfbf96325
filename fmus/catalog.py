"""What the command line shows and builds: own models by name, any FMU by path."""

from __future__ import annotations

from pathlib import Path

import msgspec

from fmus import describe_fmu
from fmus.build import MODELS, build_model, own_models
from fmus.describe import read_model
from fmus.description import PlantDescription
from fmus.errors import PlantError


class Entry(msgspec.Struct, frozen=True):
    """One own model, as `marconet fmu list` shows it."""

    name: str
    about: str
    inputs: int
    outputs: int
    parameters: int


def models() -> list[Entry]:
    """The models that come with this package; reads their tables only, builds nothing."""
    entries = []
    for name in own_models():
        model = read_model(MODELS / name / "variables.toml")
        kinds = [scalar.kind for scalar in model.scalars()]
        entries.append(Entry(name, model.description, *(kinds.count(k) for k in ("input", "output", "parameter"))))
    return entries


def fmu_path(plant: str | Path, fmi_version: str = "3.0") -> Path:
    """The archive that `plant` means: a path that ends in .fmu, or an own model (`linear_system`, `fmus/linear_system`)
    or a model folder, which is built if need be."""
    text = str(plant)
    if text.endswith(".fmu"):
        return Path(plant)
    own = text.removeprefix("fmus/")
    if own in own_models():
        return build(own, fmi_version)
    if (Path(plant) / "variables.toml").is_file():
        return build_model(Path(plant), fmi_version)
    raise PlantError(f"{text}: no such plant: give a path that ends in .fmu, a folder with variables.toml and model.c, "
                     f"or one of {', '.join(own_models())}")


def build(model: str, fmi_version: str = "3.0") -> Path:
    """The FMU of an own model, built if it is not in the cache yet."""
    return build_model(model, fmi_version)


def info(plant: str | Path, fmi_version: str = "3.0") -> PlantDescription:
    """All about one plant: its `variables` are the table to show."""
    return describe_fmu.describe(fmu_path(plant, fmi_version))
