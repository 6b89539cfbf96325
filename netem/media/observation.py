"""What a medium tells besides the fates of frame copies: events and samples to an observer, files of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class MediumObserver:
    event: Callable[[int, str, str, str], None] = lambda time_ns, node, kind, detail: None
    sample: Callable[[str, int, list[float]], None] = lambda medium, time_ns, values: None


class MediumLog(Protocol):
    def finish(self) -> None:
        """Close its files, which have their names only now."""
