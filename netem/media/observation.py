"""The observer of a medium, which receives its events and samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from netem.records.events import Event


@dataclass(frozen=True)
class MediumObserver:
    event: Callable[[Event], None] = lambda event: None
    sample: Callable[[str, int, list[float]], None] = lambda medium, time_ns, values: None
