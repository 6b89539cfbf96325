"""Provides Plotly for a page: inside it, or as one file that all reports of a folder share.

The bundle is that of the Python package `plotly` (4.8 MB), see decision 0020. A single report contains it, so that the
page can be sent alone. Run folders beside each other share one file in their parent folder, which each page names as
`../plotly-VERSION.min.js` and browsers load from the disk.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from importlib.resources import files
from itertools import islice
from pathlib import Path
from typing import Final, Literal
from uuid import uuid4

from experiments.judge.run_files import SCENARIO

MOST_SIBLINGS: Final = 1_000        # most folders searched for another run

Where = Literal["auto", "inside", "beside"]


@cache
def plotly_source() -> str:
    """Return the JavaScript of the installed package, read once in a process."""
    return (files("plotly") / "package_data" / "plotly.min.js").read_text("utf-8")


def plotly_name() -> str:
    """Return the name of the shared file, with the version of plotly.js from its first lines."""
    version = re.search(r"plotly\.js v([0-9A-Za-z.-]+)", plotly_source()[:300])
    return f"plotly-{version[1] if version else 'js'}.min.js"


def shared_plotly(run_dir: Path, where: Where = "auto") -> str | None:
    """Return the address of the shared file, relative to `run_dir`; None if the page has to contain Plotly.

    The file is written if it is missing. With "auto" it is shared if the folder of another run lies beside this one and
    the file can be written; with "beside" OSError is raised if it cannot.
    """
    if where == "inside" or (where == "auto" and not _has_siblings(run_dir)):
        return None
    name = plotly_name()
    path = run_dir.absolute().parent / name
    try:
        if not _is_ours(path):
            _write(path, plotly_source().encode())
        return f"../{name}" if _is_ours(path) else None
    except OSError:
        if where == "beside":
            raise
        return None


def _has_siblings(run_dir: Path) -> bool:
    own = run_dir.absolute()
    if (own.parent / plotly_name()).exists():
        return True
    return any(folder != own.name and _holds_a_run(own.parent / folder)
               for folder in islice(_folders(own.parent), MOST_SIBLINGS))


def _folders(parent: Path) -> Iterator[str]:
    with suppress(OSError), os.scandir(parent) as entries:
        yield from (entry.name for entry in entries if entry.is_dir(follow_symlinks=False))


def _holds_a_run(folder: Path) -> bool:
    with suppress(OSError):
        return SCENARIO.is_in(folder) and (folder / "report.html").is_file()
    return False


def _is_ours(path: Path) -> bool:
    """Return whether the file is whole and belongs to this user, as the page executes it."""
    with suppress(FileNotFoundError):
        return (path.is_file() and not path.is_symlink() and path.stat().st_uid == os.getuid()
                and path.read_bytes() == plotly_source().encode())
    return False


def _write(path: Path, content: bytes) -> None:
    """Write the file under another name first, so that no run that ends at the same time reads a part of it."""
    part = path.with_name(f".{path.name}.{uuid4().hex}.part")
    try:
        part.write_bytes(content)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
