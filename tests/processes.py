"""Processes as /proc shows them. One may end between the opening of its file and the reading of it."""

from __future__ import annotations

from pathlib import Path


def alive(pid: int | str) -> bool:
    """Whether the process is there, and no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(errors="replace").rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def children(pid: int | str) -> list[int]:
    """The processes that `pid` has started and that are there; none once it has ended."""
    try:
        return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except (FileNotFoundError, ProcessLookupError):
        return []
