"""Remedies for a path that does not exist: the nearest name that exists, or all names."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from experiments.scenario.problems import near, value_text
from netem.core.nearest import nearest

DEEPEST = 3                 # levels of folders below the scenario's that are searched
MOST = 200                  # most files listed, and a tenth of the entries searched
TOLD = 8                    # most paths in an error


def near_file(wanted: str, there: Sequence[str]) -> str:
    """Return the remedy for a path that does not exist: the path with the nearest file name, or all paths."""
    by_name = {Path(path).stem: path for path in reversed(there)}
    if (close := nearest(Path(wanted).stem, by_name)) is not None:
        return f"did you mean {value_text(by_name[close])}?"
    if len(there) > TOLD:
        return f"there are {', '.join(there[:TOLD])} and {len(there) - TOLD} more"
    return near("", there)


def plants_in(folder: Path) -> list[str]:
    """Return the FMUs and model folders in and below `folder`, as a scenario in it names them."""
    found = [path for path in _entries(folder)
             if path.suffix == ".fmu" or (path.is_dir() and (path / "variables.toml").is_file())]
    return sorted(str(path.relative_to(folder)) for path in found)


def files_like(missing: Path) -> list[str]:
    """Return files with the suffix of `missing` in its folder, or in the nearest folder above that exists."""
    folder = next((above for above in missing.parents if above.is_dir()), missing.parent)
    found: Iterable[Path] = folder.glob(f"*{missing.suffix}") if folder.is_dir() else ()
    return sorted(str(path.relative_to(missing.parent) if folder == missing.parent else path) for path in found)[:MOST]


def _entries(folder: Path) -> Iterator[Path]:
    seen = 0
    for where, folders, files in os.walk(folder):
        depth = len(Path(where).relative_to(folder).parts)
        folders[:] = sorted(name for name in folders if not name.startswith((".", "__"))) if depth < DEEPEST else []
        for name in (*folders, *sorted(files)):
            seen += 1
            if seen > MOST * 10:
                return
            yield Path(where) / name
