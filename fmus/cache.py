"""Where built and unpacked FMUs are kept: content-addressed folders that appear whole or not at all.

Several processes may fill the cache at once: each writes to a folder of its own and renames it into place; the first
one wins and the others take its result.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from fmus.errors import PlantError


def cache_folder() -> Path:
    """$MARCONET_CACHE, or the user's cache folder of this platform."""
    if named := os.environ.get("MARCONET_CACHE"):
        return Path(named)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local")) / "marconet"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "marconet"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "marconet"


def kept(folder: Path, make: Callable[[Path], None]) -> Path:
    """`folder`, filled by `make` unless it is there already."""
    if folder.is_dir():
        return folder
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    except OSError as error:
        raise PlantError(f"{folder.parent}: cannot write to the cache ({error.strerror}): "
                         "set MARCONET_CACHE to a folder that is writable") from None
    try:
        make(draft)
        draft.chmod(0o755)
        try:
            draft.rename(folder)
        except OSError:
            if not folder.is_dir():     # lost to nobody: a real failure
                raise
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return folder
