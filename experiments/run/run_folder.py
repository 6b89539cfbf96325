"""The folder of a run: one process owns it during the run, and it is overwritten only on request.

    claim -> lock `run.lock`, space for summary.json and run.json -> ... records ... -> release

A run is *finished* if `summary.json` exists, whether the run ended by itself, failed or was aborted. Without it the run
was killed, and `killed_run` makes the records from the journals. A new run refuses either folder.

The lock is one of the operating system, which releases it when the process ends in any way.
"""

from __future__ import annotations

import os
import shutil
import socket
from contextlib import suppress
from datetime import datetime
from pathlib import Path

import msgspec

from experiments.judge.run_files import JOURNALS, LOCK, RECORDS, RUN, SCENARIO, SUMMARY
from netem.records.part_file import SUFFIX
from netem.records.table import RECORDERS

try:
    import fcntl
except ImportError:                     # not on Windows: nothing is locked there
    fcntl = None                        # type: ignore[assignment]


class FolderTaken(ValueError):
    """Another process runs a scenario into the folder, or it holds the records of a run."""

    exit_code = 2
    leaves_records = False


class RunFolder:
    """The folder at `path`, claimed by this process."""

    def __init__(self, path: Path, lock: int | None, *, made: bool) -> None:
        self.path = path
        self._made = made
        self._lock = lock
        self._lock_file = None if lock is None else os.fstat(lock).st_ino

    @classmethod
    def claim(cls, path: Path, *, overwrite: bool = False) -> RunFolder:
        """Return the folder for a new run, made if it is missing; FolderTaken if it is in use or holds another run."""
        made = not path.exists()
        path.mkdir(parents=True, exist_ok=True)
        lock = _lock(path)
        try:
            if not overwrite:
                _refuse_run(path)
            clear(path)
            folder = cls(path, lock, made=made)
            SUMMARY.reserve(path)
            RUN.reserve(path)
        except BaseException:
            cls(path, lock, made=made).release()
            raise
        return folder

    @classmethod
    def left(cls, path: Path) -> RunFolder:
        """Return the folder of a run that was killed, with its files; FolderTaken if the run is still in progress."""
        return cls(path, _lock(path), made=False)

    def abandon(self) -> None:
        """Remove the files of a run that could not begin, and the folder if `claim` made it."""
        clear(self.path)
        self.release()
        if self._made:
            with suppress(OSError):
                self.path.rmdir()

    def release(self) -> None:
        """Release the lock, so that other processes may claim the folder."""
        if self._lock is not None:
            (self.path / LOCK).unlink(missing_ok=True)
            if self.holds():
                os.close(self._lock)
        self._lock = None

    def holds(self) -> bool:
        """Return False if a robot program has closed the files of this process, of which the lock is the first."""
        if self._lock is None:
            return True
        try:
            return os.fstat(self._lock).st_ino == self._lock_file
        except OSError:
            return False


def owner(path: Path) -> str:
    """Return a description of the process that runs a scenario into `path`, "" if there is none."""
    if fcntl is None or not (path / LOCK).exists():
        return ""
    with (path / LOCK).open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return file.read().decode(errors="replace") or "another process"
        except OSError:
            return ""
    return ""


def clear(path: Path) -> None:
    """Remove the records of a run, whole or in parts; other files in the folder stay."""
    there = set(os.listdir(path))
    records = {*_recorded(path), *RECORDS, *JOURNALS} if there - {LOCK} else set()
    for name in sorted(there & (records | {record + SUFFIX for record in records})):
        (path / name).unlink(missing_ok=True)
    if "logs" in there:
        shutil.rmtree(path / "logs", ignore_errors=True)


def _lock(path: Path) -> int | None:
    """Return the descriptor that holds the lock, None without locks; FolderTaken names the process that has it."""
    if fcntl is None:
        return None
    while True:
        descriptor = os.open(path / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            who = os.read(descriptor, 1000).decode(errors="replace") or "another process"
            os.close(descriptor)
            raise FolderTaken(f"{path}: {who} runs a scenario into it: wait for its end, or name another folder") \
                from None
        except OSError:
            os.close(descriptor)        # a file system without locks
            return None
        with suppress(FileNotFoundError):
            if os.fstat(descriptor).st_ino == (path / LOCK).stat().st_ino:
                break
        os.close(descriptor)            # the former owner has removed the file
    os.truncate(descriptor, 0)
    os.write(descriptor, f"process {os.getpid()} on {socket.gethostname()}, since {datetime.now():%Y-%m-%d %H:%M:%S},"
             .encode())
    return descriptor


def _refuse_run(path: Path) -> None:
    if SUMMARY.is_in(path):
        raise FolderTaken(f"{path}: holds the records of a finished run: name another folder, or say --overwrite "
                          "(overwrite=True) to replace them")
    if SCENARIO.is_in(path):
        raise FolderTaken(f"{path}: holds the records of a run that was killed: `marconet report {path}` makes them "
                          "readable, --overwrite (overwrite=True) replaces them")


def _recorded(path: Path) -> list[str]:
    """Return the names of the files that recorders may have written for the run in `path`."""
    try:
        scenario = SCENARIO.read(path)
        media, nodes = (*scenario["media"], ""), (*scenario.get("agents", ()), *scenario.get("gateways", ()))
        return list({file.format(medium=medium, node=node) for recorder in RECORDERS.values()
                     for file in recorder.FILES for medium in media for node in (nodes if "{node}" in file else ("",))})
    except (OSError, msgspec.MsgspecError, KeyError, TypeError):
        return []
