"""The records of a run, as its runner sees them: a folder of files, or memory from which only figures are taken.

    feed, ledger -> ... the run ... -> guarantees -> finishing -> standing -> data -> verdicts -> summary -> report

`FolderRecords` are those of `marconet run`. `FigureRecords` serve campaigns, where a run leaves its figures and its
hash: they write nothing, and hold the frame copies and samples by which `[expect]` is judged until the run is freed.
"""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Protocol

from experiments.judge.derived_signals import derive
from experiments.judge.frame_copies import FrameCopies
from experiments.judge.monitors.outcome import Outcome
from experiments.judge.run_data import RunData, load_run
from experiments.judge.run_files import GUARANTEES, LEDGER, RUN, SCENARIO, SUMMARY, Json
from experiments.judge.run_result import Summary
from experiments.run.program_mistakes import ProgramMistakes
from experiments.run.recording import Recording
from experiments.run.run_folder import RunFolder
from experiments.scenario.model import Scenario
from netem.core.fate import Fate
from netem.media.medium import Medium
from netem.records import Feed, Place
from netem.records.events import Event, in_order
from netem.records.kept_samples import KeptSamples
from netem.records.ledger import Ledger, LedgerResult
from netem.records.ledger_in_memory import LedgerInMemory
from netem.records.signal_table import with_deaths

PACKAGES = ("marconet", "eclipse-zenoh", "fmpy", "numpy", "simpy", "msgspec")


class RunRecords(Protocol):
    """`folder` is where processes of robots write their logs; `report` is the name of the report, None without one."""

    folder: Path
    feed: Feed
    report: str | None

    def open_ledger(self, passed_ns: Callable[[], int]) -> Ledger:
        """Return the ledger of the run; `passed_ns` as in `Ledger`."""

    def begin(self, media: Mapping[str, Medium]) -> None:
        """Subscribe to the media, before the first grant."""

    def keep(self, standing: Json) -> None:
        """Write the records so far, so that they outlive this process."""

    def hold(self) -> bool:
        """Return False if a robot program has closed the files of the records."""

    def copies(self) -> FrameCopies:
        """The frame copies of the ledger, which is finished."""

    def write_guarantees(self, outcomes: Sequence[Outcome]) -> None: ...

    def finishing(self) -> Iterable[Callable[[], object]]:
        """The steps that close the recorders; the runner takes each, whether or not another fails."""

    def write_standing(self, standing: Json) -> None:
        """Take how far the run came, and its counters."""

    def data(self) -> RunData:
        """The records as `[expect]` is judged by them."""

    def warnings(self, ledger: LedgerResult) -> list[str]:
        """A line for each mistake of a program that ended nothing."""

    def write_summary(self, summary: Summary) -> None: ...

    def write_report(self) -> None: ...


class FolderRecords:
    """Writes the files of a run folder, which the caller has claimed and into which it has written the scenario."""

    def __init__(self, scenario: Scenario, owned: RunFolder, report: bool) -> None:
        self.folder = owned.path
        self.report = "report.html" if report else None
        self._owned = owned
        self._names = {"scenario": scenario.name, "seed": str(scenario.seed)}
        self._recording = Recording(scenario, Place(
            self.folder, self._names, (self.folder / SCENARIO.name).read_bytes(), scenario.length_ns,
            {name: medium.settings for name, medium in scenario.media.items()}))
        self.feed = self._recording.feed
        self._mistakes = ProgramMistakes()
        self.feed.events.append(self._mistakes.event)

    def open_ledger(self, passed_ns: Callable[[], int]) -> Ledger:
        return Ledger(self.folder / LEDGER, metadata=self._names, listeners=self.feed.copies, passed_ns=passed_ns)

    def begin(self, media: Mapping[str, Medium]) -> None:
        self._recording.begin(media)

    def keep(self, standing: Json) -> None:
        self._recording.keep()
        RUN.update(self.folder, standing | {"versions": {}})

    def hold(self) -> bool:
        return self._owned.holds()

    def copies(self) -> FrameCopies:
        return FrameCopies.of_file(self.folder / LEDGER)

    def write_guarantees(self, outcomes: Sequence[Outcome]) -> None:
        GUARANTEES.write(self.folder, outcomes)

    def finishing(self) -> Iterable[Callable[[], object]]:
        return [recorder.finish for recorder in self._recording.recorders]

    def write_standing(self, standing: Json) -> None:
        RUN.write(self.folder, standing | {"versions": _versions()})

    def data(self) -> RunData:
        return load_run(self.folder)

    def warnings(self, ledger: LedgerResult) -> list[str]:
        told = self._mistakes.lines()
        if not ledger.by_fate.get(Fate.MALFORMED.value):
            return told
        from netem.records.malformed import malformed_frames

        return [*told, *malformed_frames(self.folder / LEDGER)]

    def write_summary(self, summary: Summary) -> None:
        SUMMARY.write(self.folder, summary)

    def write_report(self) -> None:
        if self.report is not None:
            from experiments.show.report.build import write_report

            write_report(self.folder)


class FigureRecords:
    """Writes no file. `summary` is that of the run, once it has ended; `resolved` is `scenario.resolved()`.

    The recorders of `[records]` and of media are left out: they write what a repeated run has, and no figure.
    """

    report: str | None = None

    def __init__(self, scenario: Scenario, resolved: Json, logs: Path) -> None:
        self.folder = logs
        self.feed = Feed()
        self.summary: Summary | None = None
        self._scenario = scenario
        self._resolved = resolved
        self._frames = LedgerInMemory()
        self._declared: dict[str, Sequence[tuple[str, str]]] = {}
        self._samples = KeptSamples()
        self._events: list[Event] = []
        self._standing: Json = {}
        self._outcomes: Sequence[Outcome] = ()

    def open_ledger(self, passed_ns: Callable[[], int]) -> Ledger:
        return Ledger(file=self._frames, listeners=self.feed.copies, passed_ns=passed_ns)

    def begin(self, media: Mapping[str, Medium]) -> None:
        self.feed.frames = {name: medium.taps for name, medium in media.items()}
        self.feed.declared.append(self._declared.__setitem__)
        self.feed.samples.append(self._samples.append)
        self.feed.events.append(self._events.append)

    def keep(self, standing: Json) -> None:
        """Do nothing: a run that is killed is repeated."""

    def hold(self) -> bool:
        return True

    def copies(self) -> FrameCopies:
        return FrameCopies.of_memory(self._frames)

    def write_guarantees(self, outcomes: Sequence[Outcome]) -> None:
        self._outcomes = outcomes

    def finishing(self) -> Iterable[Callable[[], object]]:
        return ()

    def write_standing(self, standing: Json) -> None:
        self._standing = standing

    def data(self) -> RunData:
        missing: list[str] = []
        tables = with_deaths(self._samples.tables(self._declared), self._standing["dead_ns"])
        signals = derive(self._resolved["derived"], tables, self._scenario.folder, missing)
        return RunData(self._standing["reached_ns"], self.copies(), signals, self._standing["counters"],
                       in_order(self._events), self._resolved, run=self._standing, missing=missing,
                       guarantees={outcome.standing.name: outcome for outcome in self._outcomes})

    def warnings(self, ledger: LedgerResult) -> list[str]:
        return []

    def write_summary(self, summary: Summary) -> None:
        self.summary = summary

    def write_report(self) -> None:
        """Do nothing: the report of a campaign is about all of its runs."""

    def clear(self) -> None:
        """Let go of the frame copies, so that the garbage collector does not read each of them."""
        self._frames.rows = ()


@cache
def _versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that affect a result; cached, as a look-up takes long."""
    return {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}
