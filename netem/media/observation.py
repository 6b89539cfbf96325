"""What a medium can tell besides the fates of frame copies: events, signals, counters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from netem.records.events import Event


@dataclass(frozen=True)
class MediumObserver:
    event: Callable[[Event], None] = lambda event: None
    sample: Callable[[str, int, list[float]], None] = lambda medium, time_ns, values: None


@runtime_checkable
class ObservedMedium(Protocol):
    name: str
    signals: Sequence[tuple[str, str]]          # (name, unit), recorded under the name of the medium

    def observe(self, observer: MediumObserver) -> None:
        """Tell `observer` from now on. An instant may lie ahead of the call, even beyond the end of the run."""

    def counters(self) -> Mapping[str, Mapping[str, int]]:
        """By node, or by the name of the medium for what is no node's."""
