"""Cache of built and unpacked FMUs: content-addressed folders that appear complete or not at all.

Several processes may fill the cache at once: each writes to a folder of its own and renames it into place. The first
rename succeeds; the other processes use its result.

Libraries in the cache are loaded and run, so their content is checked: every folder holds a list of its files with
size, time of change and digest. A folder that differs from its list is made again, with a note on stderr. A cache that
belongs to another user, or that other users may write to, is refused with PlantError.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Final

from platformdirs import user_cache_path

from fmus.errors import PlantError

FILES: Final = ".files"             # a line for each file: size, time of change [ns], digest, name


def cache_folder() -> Path:
    """Return $MARCONET_CACHE if it is set, otherwise `marconet` in the user's cache folder of this platform."""
    if named := os.environ.get("MARCONET_CACHE"):
        return Path(named)
    return user_cache_path("marconet", appauthor=False, opinion=False)


def kept(folder: Path, make: Callable[[Path], None]) -> Path:
    """Return `folder`; if it is missing or damaged, `make` fills it first, in a draft folder given to `make`.

    Raises PlantError if other users may write to the cache, or if the cache cannot be written."""
    for part in (folder.parent.parent, folder.parent, folder):
        if problem := why_untrusted(part):
            raise PlantError(problem)
    if folder.is_dir():
        damage = damage_in(folder)
        if not damage:
            return folder
        print(f"{folder}: {damage}: it is made again", file=sys.stderr)
        _remove(folder)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    except OSError as error:
        raise PlantError(f"{folder.parent}: cannot write to the cache ({error.strerror}): "
                         "set MARCONET_CACHE to a folder that is writable") from None
    try:
        make(draft)
        _list_files(draft)
        draft.chmod(0o755)
        try:
            draft.rename(folder)
        except OSError:
            if not folder.is_dir():     # no other process made the folder first, so the rename itself failed
                raise
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return folder


def damage_in(folder: Path) -> str:
    """Return, in words, how the files in `folder` differ from its list; "" if they do not."""
    try:
        lines = (folder / FILES).read_text(encoding="utf-8").splitlines()
        listed = [line.split(" ", 3) for line in lines]
        for size, changed_ns, digest, name in listed:
            found = (folder / name).stat()
            if found.st_size != int(size):
                return f"{name} has {found.st_size} bytes instead of {size}"
            if found.st_mtime_ns != int(changed_ns) and _digest(folder / name) != digest:
                return f"{name} was changed"
    except OSError as error:
        return f"{Path(error.filename or FILES).name}: {error.strerror}"
    except ValueError:
        return f"{FILES} is not as it was written"
    return ""


def why_untrusted(folder: Path) -> str:
    """Return why another user may have written `folder`, with the remedy; "" if none could or there is no folder."""
    if not hasattr(os, "getuid"):
        return ""                       # on Windows only the user may write to the user's folders
    try:
        found = folder.stat()
    except OSError:
        return ""
    if found.st_uid != os.getuid():
        return (f"{folder}: belongs to user {found.st_uid}, and what is in a cache is run: set MARCONET_CACHE to a "
                "folder of your own")
    by_others = found.st_mode & stat.S_IWOTH
    by_group = found.st_mode & stat.S_IWGRP and found.st_gid != os.getgid()     # a user's own group is mostly private
    if by_others or by_group:
        return (f"{folder}: others may write to it, and what is in a cache is run: chmod go-w it, or set "
                "MARCONET_CACHE to a folder that only you can write to")
    return ""


def _list_files(folder: Path) -> None:
    lines = []
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.name != FILES:
            found = path.stat()
            lines.append(f"{found.st_size} {found.st_mtime_ns} {_digest(path)} {path.relative_to(folder)}\n")
    (folder / FILES).write_text("".join(lines), encoding="utf-8")


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "blake2b").hexdigest()[:32]


def _remove(folder: Path) -> None:
    """Remove a damaged folder, by a rename first, so that no other process sees a half of it."""
    try:
        away = Path(tempfile.mkdtemp(prefix=f".{folder.name}-damaged-", dir=folder.parent))
        folder.rename(away / "it")
    except OSError as error:
        raise PlantError(f"{folder}: is damaged and cannot be removed ({error.strerror}): remove it, or set "
                         "MARCONET_CACHE to a folder that is writable") from None
    shutil.rmtree(away, ignore_errors=True)
