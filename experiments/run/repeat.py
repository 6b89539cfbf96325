"""What a run was made with, by its folder: the scenario's file, the values that replaced some of it, and its fates.

    scenario.json --path, changes, fates_of--> MadeWith --load--> the scenario of the run
    injected.toml --faults from outside-->              --words--> `marconet run ...` that makes it again
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

import msgspec

from experiments.judge.run_files import INJECTED, SCENARIO
from experiments.scenario import overrides as overriding
from experiments.scenario.document import read
from experiments.scenario.loader import load
from experiments.scenario.model import Scenario
from experiments.scenario.problems import Problems, ScenarioError
from experiments.scenario.toml_text import set_options

Match = Literal["number", "instant"]
FATES_OF: Final = "fates_of"            # key of `scenario.json`: the earlier run whose fates were met, and how


class MadeWith(NamedTuple):
    """`changes` are values by their paths in the file; `fates_of` is the folder of an earlier run, "" for none.

    Faults that came from outside are among the `changes`, behind those of the file.
    """

    path: Path
    changes: dict[str, Any]
    fates_of: str = ""
    match: Match = "number"

    def load(self, seed: int | None = None, duration_s: float | None = None, overrides: Sequence[str] = (),
             values: Mapping[str, Any] | None = None) -> Scenario:
        """Return the scenario of the run, with further changes as `load_tables` takes them."""
        return load(self.path, seed=seed, duration_s=duration_s, values=values,
                    overrides=(*set_options(self.changes)[1::2], *overrides))

    def words(self) -> list[str]:
        """Return the words of `marconet run` that name the scenario, its changes and its fates."""
        seed = [str(self.changes["seed"])] if "seed" in self.changes else []
        changes = {path: value for path, value in self.changes.items() if path != "seed"}
        fates = ["--fates-of", self.fates_of, "--match", self.match] if self.fates_of else []
        return ["marconet", "run", str(self.path), *(["--seed", *seed] if seed else []), *set_options(changes), *fates]


def holds_run(folder: Path) -> bool:
    return SCENARIO.is_in(folder)


def made_with(folder: Path) -> MadeWith:
    """Return what the run in `folder` was made with; ScenarioError if that cannot be read, or is no file any more."""
    try:
        old = SCENARIO.read(folder)
        path, changes = Path(old["path"]), dict(old["changes"])
        fates_of, match = old.get(FATES_OF, ("", "number"))
    except (OSError, msgspec.MsgspecError, KeyError, TypeError, ValueError) as error:
        raise ScenarioError([f"{folder}: its {SCENARIO.name} does not tell what the run was made with "
                             f"({type(error).__name__}: {error}): name the folder of a run of this version"]) from None
    if not path.is_file():
        raise ScenarioError([f"{folder}: the scenario of this run, {path}, is no file: it was moved, or built in "
                             "Python; put it there"])
    if (folder / INJECTED).is_file():
        tables, _ = read(path)
        overriding.apply(tables, (), changes, list(tables), Problems(path.name))
        injected = tomllib.loads((folder / INJECTED).read_text(encoding="utf-8"))["faults"]
        changes["faults"] = [*tables.get("faults", ()), *injected]
    return MadeWith(path, changes, fates_of, match)
