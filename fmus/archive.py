"""Unpacks an FMU archive into a folder, and refuses an archive that would write outside the folder or too many bytes.

FMI names the files of an archive by their path from the archive's root, with `/`. Some tools write `\\` instead, or
begin every name with `./`: both are read as the FMI name. PlantError is raised for an encrypted entry, a path that
leaves the archive (`..`, an absolute path, a drive letter), more than `MOST_BYTES` unpacked bytes or `MOST_ENTRIES`
entries, and a modelDescription.xml that is missing or not at the root.
"""

from __future__ import annotations

import re
import zipfile
import zlib
from pathlib import Path, PurePosixPath
from typing import Final

from fmus.errors import PlantError

MOST_BYTES: Final = 2 * 1024**3
MOST_ENTRIES: Final = 100_000
ENCRYPTED: Final = 1            # bit of a zip entry's flags
DESCRIPTION: Final = "modelDescription.xml"
_CHUNK: Final = 1024 * 1024


def unpack(archive: Path, folder: Path, most_bytes: int = MOST_BYTES) -> None:
    """Write every file of `archive` below `folder`; raises PlantError, with one line, for an archive to be refused."""
    try:
        with zipfile.ZipFile(archive) as file:
            entries = _entries(file, archive, most_bytes)
            _require_description(entries, archive)
            left = most_bytes
            for name, entry in entries.items():
                left = _write(file, entry, folder / name, left)
                if left < 0:
                    raise _too_large(archive, most_bytes)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, ValueError, KeyError) as error:
        raise PlantError(f"{archive}: not a whole zip archive ({one_line(error)}): it may be truncated; fetch or build "
                         "it again") from None
    except OSError as error:
        raise PlantError(f"{archive}: cannot be unpacked ({error.strerror or one_line(error)}): fetch or build it "
                         "again, and see that there is room for it") from None


def one_line(error: BaseException) -> str:
    """Return the text of a library's error on one line, without control characters, shortened."""
    text = " ".join(str(error).split())
    text = "".join(letter if letter.isprintable() else "?" for letter in text) or type(error).__name__
    return text if len(text) <= 300 else f"{text[:297]}..."


def _entries(file: zipfile.ZipFile, archive: Path, most_bytes: int) -> dict[str, zipfile.ZipInfo]:
    """Return the entries of the archive, each under its normalized path from the archive's root."""
    infos = file.infolist()
    if len(infos) > MOST_ENTRIES:
        raise PlantError(f"{archive}: holds {len(infos)} entries: at most {MOST_ENTRIES} are unpacked; leave out "
                         "what the FMU does not need")
    if sum(info.file_size for info in infos) > most_bytes:
        raise _too_large(archive, most_bytes)
    entries: dict[str, zipfile.ZipInfo] = {}
    for info in infos:
        if info.flag_bits & ENCRYPTED:
            raise PlantError(f"{archive}: {shown(info.filename)} is encrypted: an FMU has no password; export or zip "
                             "it again without one")
        path = info.orig_filename.partition("\0")[0].replace("\\", "/")
        parts = [part for part in path.split("/") if part not in ("", ".")]
        if path.startswith("/") or ".." in parts or re.match(r"[A-Za-z]:", path):
            raise PlantError(f"{archive}: {shown(info.filename)} lies outside the archive: a name in an FMU is a path "
                             "from its top; do not use this file, and export it again")
        if parts and not path.endswith("/"):
            entries["/".join(parts)] = info
    for name in entries:
        for above in PurePosixPath(name).parents:
            if str(above) in entries:
                raise PlantError(f"{archive}: {shown(str(above))} is a file and a folder at once: export it again")
    return entries


def _require_description(entries: dict[str, zipfile.ZipInfo], archive: Path) -> None:
    if DESCRIPTION in entries:
        return
    inside = sorted((name for name in entries if name.endswith(f"/{DESCRIPTION}")), key=len)
    if inside:
        folder = inside[0].removesuffix(DESCRIPTION)
        raise PlantError(f"{archive}: {DESCRIPTION} lies in the folder {shown(folder)} of the archive: an FMU has it "
                         f"at its top; zip what is in {shown(folder)}, not the folder itself")
    raise PlantError(f"{archive}: holds no {DESCRIPTION}: it is a zip archive but not an FMU")


def _write(file: zipfile.ZipFile, entry: zipfile.ZipInfo, path: Path, left: int) -> int:
    """Unpack one file, of which at most `left` bytes are allowed; returns the bytes still allowed, < 0 if exceeded."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with file.open(entry) as source, path.open("wb") as target:
        while left >= 0 and (data := source.read(_CHUNK)):
            left -= len(data)
            target.write(data)
    return left


def _too_large(archive: Path, most_bytes: int) -> PlantError:
    return PlantError(f"{archive}: unpacks to more than {most_bytes / 1024**3:g} GiB: an FMU of that size is not "
                      "unpacked; leave large files out of its resources")


def shown(name: str) -> str:
    """Return a name from an archive made printable on one line of an error message."""
    text = "".join(letter if letter.isprintable() else "?" for letter in name)
    return text if len(text) <= 120 else f"{text[:117]}..."
