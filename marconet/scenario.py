"""A scenario as a user of the library holds it: loaded from a file, or built from tables in Python."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Any

from experiments.scenario import model
from experiments.scenario.library import find
from experiments.scenario.loader import load as load_file
from experiments.scenario.loader import load_tables


class Scenario:
    """A scenario that was checked and can be run. `run` never changes it.

    `tables` are the keys of a scenario file (docs/scenario.md) in Python's types: `seed`, `length_s`, `agents`,
    `media`, `impairments`, `expect` and so on. `folder` is where its paths start and where its programs may lie.

    ScenarioError holds every problem found, in the words of `marconet check`.
    """

    def __init__(self, name: str, *, folder: str | PurePath = ".", question: str = "", **tables: Any) -> None:
        self.checked: model.Scenario = load_tables(_plain(tables), question, Path(folder) / f"{name}.toml")
        self.changes: dict[str, Any] = {}

    @classmethod
    def of(cls, checked: model.Scenario, changes: dict[str, Any]) -> Scenario:
        """The Scenario for what the loader returned; `changes` are the values that differ from its file, by path."""
        scenario = cls.__new__(cls)
        scenario.checked, scenario.changes = checked, changes
        return scenario

    @property
    def name(self) -> str:
        return self.checked.name

    @property
    def question(self) -> str:
        """The question in the comment that opens the file, "" if there is none."""
        return self.checked.question

    @property
    def seed(self) -> int:
        return self.checked.seed

    @property
    def length_s(self) -> float:
        """Emulated time that a run takes [s]."""
        return self.checked.length_ns * 1e-9

    def resolved(self) -> dict[str, Any]:
        """Every table with every default filled in, times in integer nanoseconds: as in a run's `scenario.json`."""
        return self.checked.resolved()

    def __repr__(self) -> str:
        agents = len(self.checked.agents)
        return f"<marconet.Scenario {self.name}: {agents} agents, {self.length_s:g} s, seed {self.seed}>"


def load(path: str | PurePath, *, set: Mapping[str, Any] | None = None,     # as --set of the command
         seed: int | None = None, length_s: float | None = None) -> Scenario:
    """The scenario in the file `path`, or of that name in ./scenarios or in marconet's own library.

    `set` replaces values by their paths, as in `{"impairments[0].loss_ratio": 0.3, "media.radio.preset": "xbee_s2c"}`;
    `seed` and `length_s` [s] are short for two of them.

    ScenarioError holds every problem found, in the words of `marconet check`.
    """
    source = find(Path(path) if isinstance(path, PurePath) else path)
    changes = _plain(dict(set or {}))
    checked = load_file(source, seed=seed, duration_s=length_s, values=changes)
    return Scenario.of(checked, changes if length_s is None else changes | {"length_s": length_s})


def toml_text(value: Any) -> str:
    """The value written in TOML on one line, as the option `--set` takes it."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml_text(part)}" for key, part in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(map(toml_text, value))}]"
    return json.dumps(value, ensure_ascii=False)


def _plain(value: Any) -> Any:
    """The value as TOML would have given it: tuples as lists, paths as text, NumPy's numbers as Python's."""
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if isinstance(value, PurePath):
        return str(value)
    return _plain(value.tolist()) if hasattr(value, "tolist") else value
