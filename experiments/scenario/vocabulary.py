"""The words that a scenario can use: kinds of media, impairments and guarantees, links, plants, figures.

Tests bring their own.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.scenario.model import Link, Window
from experiments.scenario.plant_parameters import PlantNames

Position = Sequence[float]


@dataclass(frozen=True)
class Vocabulary:
    """Each function says by a ValueError what is wrong with what it is given, one mistake a line.

    - `select_links(on, {medium: nodes}, {medium: nodes that it shows to themselves})`: the directed links that a
      selector names;
    - `try_medium(class, name, settings, {node: where it stands})`: whether the medium fits its nodes;
    - `try_windows(impairment, windows_ns)`: whether the impairment can act in these windows only;
    - `plant_names(fmu, folder)`: the plant and what can be set in it before the first step;
    - `unknown_figures(keys, nodes, media, {guarantee: its figures})`: a line for each key of `[expect]` that no run
      could answer;
    - `over_a_window(key)`: whether a key of `[expect]` can be judged over a part of the run;
    - `medium_links(class, name, settings, {node: where it stands}, length_ns)`: the links it has at some time;
    - `subjects_of(how, on, {medium: nodes}, links, reporting nodes)`: what a guarantee's `on` names.
    """

    media: Mapping[str, type]
    impairments: Mapping[str, type]
    select_links: Callable[[str, Mapping[str, Sequence[str]], Mapping[str, Sequence[str]]], Sequence[Link]]
    try_medium: Callable[[Any, str, Any, Mapping[str, Position | None]], object]
    try_windows: Callable[[Any, Sequence[Window]], None]
    plant_names: Callable[[str, Path], PlantNames]
    unknown_figures: Callable[[Iterable[str], Collection[str], Collection[str], Mapping[str, Collection[str]]],
                              Sequence[str]]
    over_a_window: Callable[[str], bool]
    monitors: Mapping[str, Any]
    medium_links: Callable[[Any, str, Any, Mapping[str, Position | None], int], Sequence[tuple[str, str]]]
    subjects_of: Callable[[Any, str, Mapping[str, Sequence[str]], Collection[Link], Collection[str]],
                          Sequence[tuple[str, ...]]]
