"""What a medium tells besides the fates of frame copies: events and samples to an observer, files of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from netem.records.events import Event


@dataclass(frozen=True)
class MediumObserver:
    event: Callable[[Event], None] = lambda event: None
    sample: Callable[[str, int, list[float]], None] = lambda medium, time_ns, values: None


class MediumLog(Protocol):
    def finish(self) -> None:
        """Close its files, which have their names only now."""
