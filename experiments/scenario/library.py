"""Finds scenarios by path, by name in ./scenarios, or by name among those of the installed package."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from experiments.scenario.document import question_of
from experiments.scenario.files_there import near_file
from experiments.scenario.problems import ScenarioError, near, value_text
from netem.core.nearest import nearest


class Entry(NamedTuple):
    name: str
    question: str
    path: Path


def folders() -> list[Path]:
    """Return the folders with scenarios; ./scenarios precedes that of the package."""
    candidates = [Path("scenarios").absolute(), Path(str(files("scenarios")))]
    return [folder for index, folder in enumerate(candidates) if folder.is_dir() and folder not in candidates[:index]]


def find(name_or_path: str | Path) -> Path:
    """Return the file of a scenario; a name has no slash and no `.toml`. ScenarioError if there is none."""
    path = Path(name_or_path)
    if path.suffix == ".toml" or len(path.parts) != 1:
        if path.is_file():
            return path
        there = _files_in(path.parent)
        remedy = near_file(str(path), there) if there else f"there is no scenario in {path.parent}"
        raise ScenarioError([f"{path}: no such file; {remedy}"])
    entries = catalog()
    for entry in entries:
        if entry.name == str(name_or_path):
            return entry.path
    if path.is_file():
        raise ScenarioError([f"{path}: this file is no scenario: a scenario is a file whose name ends in .toml"])
    names = [entry.name for entry in entries]
    by_stem = {**{name: name for name in names}, **{Path(file).stem: file for file in _files_in(Path())}}
    close = nearest(path, by_stem)
    remedy = near("", names) if close is None else f"did you mean {value_text(by_stem[close])}?"
    raise ScenarioError([f"{path}: no such scenario; {remedy}"])


def _files_in(folder: Path) -> list[str]:
    """Return the paths of the scenarios in a folder, which may be missing."""
    return sorted(str(path) for path in folder.glob("*.toml") if not path.name.startswith("."))


def catalog() -> list[Entry]:
    """Return every scenario that has a name, in alphabetical order; one in ./scenarios hides one of the package."""
    found: dict[str, Entry] = {}
    for folder in folders():
        for path in sorted(folder.glob("*.toml")):
            if path.stem not in found:
                found[path.stem] = Entry(path.stem, question_of(path.read_text("utf-8", errors="replace")), path)
    return sorted(found.values())
