"""The vocabulary of the house: what netem carries and impairs, and what fmus knows about plants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from random import Random
from typing import Any

from experiments.scenario.files_there import near_file, plants_in
from experiments.scenario.guarantee_kinds import MONITORS
from experiments.scenario.metric_keys import over_a_window, unknown_keys
from experiments.scenario.plant_parameters import PlantNames
from experiments.scenario.problems import near
from experiments.scenario.subjects import subjects_of
from experiments.scenario.vocabulary import Position, Vocabulary
from fmus.build import build_model, model_folder, own_models
from fmus.describe import read_model, variables_of
from fmus.describe_fmu import describe
from fmus.errors import PlantError
from fmus.presets import read_presets
from netem.core import link_selector
from netem.core.agenda import Agenda
from netem.core.link_name import LinkName
from netem.impairments.table import IMPAIRMENTS
from netem.impairments.window import Window
from netem.media.links import Links
from netem.media.medium import Medium
from netem.media.table import MEDIA
from netem.records.ledger import Ledger


def house_vocabulary() -> Vocabulary:
    return Vocabulary(MEDIA, IMPAIRMENTS, select_links, try_medium, try_windows, plant_names, unknown_keys,
                      over_a_window, MONITORS, medium_links, subjects_of)


def select_links(on: str, nodes_on: Mapping[str, Sequence[str]], to_themselves: Mapping[str, Sequence[str]],
                 ) -> list[LinkName]:
    return link_selector.parse(on).resolve(nodes_on, to_themselves)


def try_medium(cls: Any, name: str, settings: Any, nodes: Mapping[str, Position | None]) -> Medium:
    ledger = Ledger()
    medium: Medium = cls(name, settings, nodes, Agenda(), ledger, Links(ledger, lambda *_: False, {}), Random)
    return medium


def medium_links(cls: Any, name: str, settings: Any, nodes: Mapping[str, Position | None],
                 length_ns: int) -> Sequence[tuple[str, str]]:
    return try_medium(cls, name, settings, nodes).links(length_ns)


def try_windows(impairment: Any, windows_ns: Sequence[tuple[int, int]]) -> None:
    Window(impairment, windows_ns)


def plant_names(fmu: str, folder: Path) -> PlantNames:
    """An own model is known without a compiler; a model folder is built; of an FMU its own description is read."""
    try:
        return _plant_names(fmu, folder)
    except OSError as error:                # a name that is too long for the file system, a folder that is not ours
        raise ValueError(f"cannot be read: {error.strerror or error}") from error


def _plant_names(fmu: str, folder: Path) -> PlantNames:
    if "/" not in fmu and not fmu.endswith(".fmu") and not (folder / fmu / "variables.toml").is_file():
        if fmu not in own_models():
            raise ValueError(f"no such model; {near(fmu, own_models())} (or give the path of a .fmu)")
        return PlantNames(fmu, variables_of(read_model(model_folder(fmu) / "variables.toml")),
                          _presets(model_folder(fmu)))
    path = (folder / fmu).absolute()
    if not path.exists():
        raise ValueError(f"no such file; {near_file(fmu, plants_in(folder))}")
    try:
        archive = build_model(path) if path.is_dir() else path
        presets = _presets(path) if path.is_dir() else {}
        description = describe(archive)
    except PlantError as error:
        raise ValueError(str(error)) from error
    return PlantNames(str(archive), description.variables, presets, description.variable_step,
                      description.fixed_step_s)


def _presets(folder: Path) -> dict[str, dict[str, Any]]:
    model = read_model(folder / "variables.toml")
    return {name: dict(preset.parameters) for name, preset in read_presets(folder, model).items()}
