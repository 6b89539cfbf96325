"""The scenario class of the library: loaded from a file, or built from tables in Python."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import Any

from experiments.run.repeat import holds_run, made_with
from experiments.scenario import model
from experiments.scenario.library import find
from experiments.scenario.loader import load as load_file
from experiments.scenario.loader import load_tables


class Scenario:
    """A checked scenario. `run` does not change it.

    `tables` are the keys of a scenario file (docs/scenario.md) with values of Python's types: `seed`, `length_s`,
    `agents`, `media`, `impairments`, `expect` and so on. Paths in them are relative to `folder`, from which programs
    are imported as well.

    Raises ScenarioError, which lists every problem found, in the words of `marconet check`.
    """

    def __init__(self, name: str, *, folder: str | PurePath = ".", question: str = "", **tables: Any) -> None:
        self.checked: model.Scenario = load_tables(plain_values(tables), question, Path(folder) / f"{name}.toml")

    @classmethod
    def of(cls, checked: model.Scenario) -> Scenario:
        """The Scenario for a result of the loader."""
        scenario = cls.__new__(cls)
        scenario.checked = checked
        return scenario

    @property
    def name(self) -> str:
        return self.checked.name

    @property
    def question(self) -> str:
        """The question in the comment at the beginning of the file, "" if there is none."""
        return self.checked.question

    @property
    def seed(self) -> int:
        return self.checked.seed

    @property
    def length_s(self) -> float:
        """Simulated time of a run [s]."""
        return self.checked.length_ns * 1e-9

    def resolved(self) -> dict[str, Any]:
        """All tables with all defaults, times in integer nanoseconds, as in a run's `scenario.json`."""
        return self.checked.resolved()

    def __repr__(self) -> str:
        agents = len(self.checked.agents)
        return f"<marconet.Scenario {self.name}: {agents} agents, {self.length_s:g} s, seed {self.seed}>"


def load(path: str | PurePath, *, set: Mapping[str, Any] | None = None,     # as --set of the command
         seed: int | None = None, length_s: float | None = None) -> Scenario:
    """Load the scenario in the file `path`, or of that name in ./scenarios or in marconet's own library.

    The folder of a run gives the scenario as it was run, with all that was set. `set` replaces values by their paths,
    as in `{"impairments[0].loss_ratio": 0.3, "media.radio.preset": "xbee_s2c"}`; `seed` and `length_s` [s] replace the
    values of these two keys.

    Raises ScenarioError, which lists every problem found, in the words of `marconet check`.
    """
    changes = plain_values(dict(set or {}))
    if holds_run(Path(path)):
        return Scenario.of(made_with(Path(path)).load(seed, length_s, values=changes))
    source = find(Path(path) if isinstance(path, PurePath) else path)
    return Scenario.of(load_file(source, seed=seed, duration_s=length_s, values=changes))


def plain_values(value: Any) -> Any:
    """Convert a value to the types that TOML has: tuples to lists, paths to text, NumPy's numbers to Python's."""
    if isinstance(value, Mapping):
        return {str(key): plain_values(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [plain_values(part) for part in value]
    if isinstance(value, PurePath):
        return str(value)
    return plain_values(value.tolist()) if hasattr(value, "tolist") else value
