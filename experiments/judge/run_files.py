"""The files in the folder of a run: their names, and the format of those in JSON.

    scenario.json       the resolved scenario, written before the start
    charts.json         what programs made before the start, to be drawn; if they have any
    run.json            how far the run came, counters, switching instants, versions
    guarantees.json     the outcome of each guarantee, if the scenario states any
    summary.json        verdicts, hash, speed, what ended the run early: a `Summary` (run_result.py)
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Generic, TypeVar

import msgspec

from experiments.judge.monitors.outcome import Outcome
from firmware_sim.height_chart import HeightChart
from netem.records.part_file import ReservedFile, part_of

Json = dict[str, Any]
Content = TypeVar("Content")

RESERVED_BYTES: Final = 1 << 16


@dataclass(frozen=True)
class JsonFile(Generic[Content]):
    """A JSON file in the folder of a run; `content` is the type that is read from it."""

    name: str
    content: type[Content]

    def is_in(self, folder: Path) -> bool:
        return (folder / self.name).is_file()

    def reserve(self, folder: Path) -> None:
        """Take the space for the file, so that `update` and `write` succeed on a full disk."""
        self._reserved(folder).reserve()

    def update(self, folder: Path, content: object) -> None:
        """Write into the reserved space what the file would hold if the run were killed now; `left` reads it."""
        self._reserved(folder).update(msgspec.json.encode(content))

    def write(self, folder: Path, content: object) -> None:
        """Write the file whole, into its reserved space if there is any."""
        self._reserved(folder).write(msgspec.json.encode(content))

    def read(self, folder: Path) -> Content:
        """Return the content; raises OSError, or msgspec.MsgspecError for content of another type."""
        return msgspec.json.decode((folder / self.name).read_bytes(), type=self.content)

    def left(self, folder: Path) -> Content | None:
        """Read the file or, of a run that was killed, the last `update`; None if neither is readable."""
        for path in (folder / self.name, part_of(folder / self.name)):
            with suppress(OSError, msgspec.MsgspecError):
                return msgspec.json.decode(path.read_bytes(), type=self.content)
        return None

    def _reserved(self, folder: Path) -> ReservedFile:
        return ReservedFile(folder / self.name, RESERVED_BYTES)


SCENARIO: Final = JsonFile("scenario.json", Json)
CHARTS: Final = JsonFile("charts.json", list[HeightChart])
RUN: Final = JsonFile("run.json", Json)
GUARANTEES: Final = JsonFile("guarantees.json", list[Outcome])
SUMMARY: Final = JsonFile("summary.json", Json)

LOCK: Final = "run.lock"
LEDGER: Final = "ledger.parquet"
INJECTED: Final = "injected.toml"           # faults that came from outside during a run in real time
FAULT_SOCKET: Final = "run.faults"          # by which they come
FAULTS_LATER: Final = "run.faults_later"    # there while a run is starting that will take them
RECORDS: Final = (SCENARIO.name, CHARTS.name, LEDGER, RUN.name, GUARANTEES.name, SUMMARY.name, "report.html", INJECTED,
                  FAULT_SOCKET, FAULTS_LATER, "outputs.svg")    # beside those of the recorders (netem/records/table.py)
JOURNALS: Final = ("ledger.rows", "signals.rows", "frames.rows")
