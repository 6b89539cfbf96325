"""Looks processes up in /proc. A process may end between the opening and the reading of its file."""

from __future__ import annotations

from pathlib import Path


def alive(pid: int | str) -> bool:
    """Whether the process exists and is no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(errors="replace").rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def children(pid: int | str) -> list[int]:
    """Ids of the child processes of `pid`; none if it has ended."""
    try:
        return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except (FileNotFoundError, ProcessLookupError):
        return []
