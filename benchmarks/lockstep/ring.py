"""The work that every system under test does, with its timing and judging; the code is the same for all of them.

    window k of node i:  receive the message that node i-1 sent in window k-1, check it, send 40 bytes to node i+1

Every node is its own OS process and stamps the start and the end of its own turns with the machine's monotonic clock,
which all processes share. Window k has begun when the last node has begun it:

    begun(k) = max over nodes of start(k)
    windows/s = (K - 1 - W) / (begun(K - 1) - begun(W))         K windows 0 .. K - 1, the first W of them warm-up

so start-up, warm-up and shut-down do not count. `lead` is the largest number of earlier windows that some node had not
finished when a node began one: 0 means that no node began a window before all had finished the one before. A system
that synchronizes neighbours only has a larger lead, does less work, and may be faster.

A message that is missing, late, early, duplicated or altered makes the figure void, and so does a turn too few or too
many.

Not measured: start-up, memory, computation of a node, more than one message per node and window.
"""

from __future__ import annotations

import json
import time
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

MESSAGE_BYTES = 40


class VoidFigure(Exception):
    """The work was not done as defined, so its duration means nothing."""


@dataclass(frozen=True)
class Task:
    """The amount of work. Windows before `warm_up` are run and checked, but not timed."""

    nodes: int
    windows: int
    warm_up: int

    def __post_init__(self) -> None:
        if self.nodes < 2:
            raise ValueError(f"nodes={self.nodes}: a ring has at least 2")
        if self.warm_up < 1 or self.windows < self.warm_up + 2:
            raise ValueError(f"windows={self.windows}, warm_up={self.warm_up}: "
                             "expected warm_up >= 1 and windows >= warm_up + 2")


@dataclass(frozen=True)
class Figure:
    system: str
    nodes: int
    windows_per_s: float
    lead_windows: int
    settings: str

    @property
    def grants_per_s(self) -> float:
        return self.nodes * self.windows_per_s


def message(sender: int, window: int) -> bytes:
    """40 printable bytes, so that text protocols need no further encoding."""
    return b"%010d%030d" % (sender, window)


@dataclass
class Member:
    """One node's part of the work. Call `turn` once per window, then `finished` when the message has been sent."""

    index: int
    task: Task
    starts_ns: list[int] = field(default_factory=list)
    ends_ns: list[int] = field(default_factory=list)
    fault: str = ""

    def turn(self, received: Sequence[bytes]) -> bytes:
        """Check the messages received for this window, none for the first, and return the message to send."""
        window = len(self.starts_ns)
        self.starts_ns.append(time.monotonic_ns())
        expected = [message((self.index - 1) % self.task.nodes, window - 1)] if window else []
        if received != expected and not self.fault:
            self.fault = f"node {self.index}, window {window}: received {received}, expected {expected}"
        return message(self.index, window)

    def finished(self) -> None:
        self.ends_ns.append(time.monotonic_ns())

    @property
    def is_done(self) -> bool:
        return len(self.ends_ns) >= self.task.windows

    def save(self, folder: Path) -> None:
        """Write the turns, first under another name, so that no reader finds an incomplete file."""
        unfinished = folder / f"{self.index}.part"
        unfinished.write_text(json.dumps([self.fault, self.starts_ns, self.ends_ns]))
        unfinished.rename(record(folder, self.index))


def record(folder: Path, index: int) -> Path:
    """Path of the file with the turns of node `index`; it exists when all turns are done."""
    return folder / f"{index}.json"


def judge(system: str, task: Task, folder: Path, settings: str) -> Figure:
    """Compute the figure from the files in `folder`; raises `VoidFigure` if the work was not done as defined."""
    starts: list[list[int]] = []
    ends: list[list[int]] = []
    for index in range(task.nodes):
        path = record(folder, index)
        if not path.exists():
            raise VoidFigure(f"{system}: node {index} of {task.nodes} left no record of its turns")
        fault, starts_ns, ends_ns = json.loads(path.read_text())
        if fault:
            raise VoidFigure(f"{system}: {fault}")
        if len(starts_ns) != task.windows or len(ends_ns) != task.windows:
            raise VoidFigure(f"{system}: node {index} had {len(starts_ns)} turns and finished {len(ends_ns)}, "
                             f"expected {task.windows}")
        starts.append(starts_ns)
        ends.append(ends_ns)
    begun_ns = [max(of_window) for of_window in zip(*starts, strict=True)]
    ended_ns = [max(of_window) for of_window in zip(*ends, strict=True)]
    lead = max(window - bisect_right(ended_ns, start_ns)
               for starts_ns in starts for window, start_ns in enumerate(starts_ns))
    span_s = (begun_ns[-1] - begun_ns[task.warm_up]) * 1e-9
    return Figure(system, task.nodes, (task.windows - 1 - task.warm_up) / span_s, lead, settings)
