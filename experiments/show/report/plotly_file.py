"""Plotly for a page: inside it, or as one file that all reports of a folder share.

The bundle is the one that the Python package `plotly` brings (4.8 MB), see decision 0020. A report holds it, so that
the page can be sent alone. Where a run folder lies beside those of other runs, the file lies once beside them, and each
page names it as `../plotly-VERSION.min.js`, which browsers load from the disk.
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

MOST_SIBLINGS: Final = 1_000        # folders looked at for another run

Where = Literal["auto", "inside", "beside"]


@cache
def plotly_source() -> str:
    """The JavaScript of the installed package, read once in a process."""
    return (files("plotly") / "package_data" / "plotly.min.js").read_text("utf-8")


def plotly_name() -> str:
    """The name of the file that reports share: with the version of plotly.js, which its first lines say."""
    version = re.search(r"plotly\.js v([0-9A-Za-z.-]+)", plotly_source()[:300])
    return f"plotly-{version[1] if version else 'js'}.min.js"


def shared_plotly(run_dir: Path, where: Where = "auto") -> str | None:
    """The address, as seen from `run_dir`, of a file that reports share, which is written if need be; None if the page
    has to hold Plotly itself. "auto": shared if another run lies beside this one and the file can be written."""
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
    """Whether the file is whole and belongs to this user: the page runs what is in it."""
    with suppress(FileNotFoundError):
        return (path.is_file() and not path.is_symlink() and path.stat().st_uid == os.getuid()
                and path.read_bytes() == plotly_source().encode())
    return False


def _write(path: Path, content: bytes) -> None:
    """Under another name first, so that a run that ends at the same time never reads half of it."""
    part = path.with_name(f".{path.name}.{uuid4().hex}.part")
    try:
        part.write_bytes(content)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
