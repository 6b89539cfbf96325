"""The vocabulary of the house: what netem carries and impairs, and what fmus knows about plants."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from random import Random
from typing import Any

from experiments.metric_keys import unknown_keys
from experiments.scenario.problems import near
from experiments.scenario.vocabulary import Position, Vocabulary
from fmus.build import model_folder, own_models
from fmus.describe import read_model
from netem import link_selector
from netem.agenda import Agenda
from netem.impairments.table import IMPAIRMENTS
from netem.impairments.window import Window
from netem.links import LinkName, Links
from netem.media.table import MEDIA
from netem.records.ledger import Ledger


def house_vocabulary() -> Vocabulary:
    return Vocabulary(MEDIA, IMPAIRMENTS, select_links, try_medium, try_windows, plant_parameters, unknown_keys)


def select_links(on: str, nodes_on: Mapping[str, Sequence[str]]) -> list[LinkName]:
    return link_selector.parse(on).resolve(nodes_on)


def try_medium(cls: Any, name: str, settings: Any, nodes: Mapping[str, Position | None]) -> None:
    ledger = Ledger()
    cls(name, settings, nodes, Agenda(), ledger, Links(ledger, lambda *_: False, {}), lambda place: Random(place))


def try_windows(impairment: Any, windows_ns: Sequence[tuple[int, int]]) -> None:
    Window(impairment, windows_ns)


def plant_parameters(fmu: str, folder: Path) -> tuple[str, Collection[str] | None]:
    """An own model is known without a compiler; of an FMU its own description is read."""
    if not fmu.endswith(".fmu"):
        if fmu not in own_models():
            raise ValueError(f"no such model; {near(fmu, own_models())} (or give the path of a .fmu)")
        model = read_model(model_folder(fmu) / "variables.toml")
        rows = [row for row in model.rows if row.kind == "parameter"]
        return fmu, [*(row.name for row in rows), *(scalar.name for row in rows for scalar in row.scalars())]
    path = (folder / fmu).absolute()
    if not path.is_file():
        there = [str(other.relative_to(folder)) for other in sorted(path.parent.glob("*.fmu"))]
        raise ValueError(f"no such file; {near(fmu, there)}")
    return str(path), None
