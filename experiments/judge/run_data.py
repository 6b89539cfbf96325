"""Reads the records of a run from its folder; parts that are missing or unreadable are listed in `missing`.

    scenario.json   the resolved scenario            ledger.parquet   every frame copy
    summary.json    verdicts, hashes, speed          signals.mcap     signals, events, and the scenario again
    run.json        switching instants, counters, how far the run came, versions
    guarantees.json the outcome of each guarantee, if the scenario states any
    charts.json     what programs made before the start, if there is something to draw

For a run that was killed the journals are read, up to the last piece that is complete.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import msgspec
import pyarrow as pa

from experiments.judge.derived_signals import derive
from experiments.judge.frame_copies import FrameCopies, LedgerUnreadable
from experiments.judge.monitors.outcome import Outcome
from experiments.judge.run_files import CHARTS, GUARANTEES, LEDGER, RUN, SCENARIO, SUMMARY, Json, JsonFile
from firmware_sim.height_chart import HeightChart
from netem.records.events import Event
from netem.records.journal import journal_of
from netem.records.ledger_file import read_metadata
from netem.records.signal_table import SignalTable, with_deaths
from netem.records.signals import FILE as SIGNALS
from netem.records.signals import Recording, read_recording


@dataclass(frozen=True)
class RunData:
    """The records of a run, of which `length_ns` are judged; `ledger` and `signals` are empty if the run left none."""

    length_ns: int
    ledger: FrameCopies
    signals: Mapping[str, SignalTable] = field(default_factory=dict)
    counters: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    events: Sequence[Event] = ()
    scenario: Json = field(default_factory=dict)
    summary: Json = field(default_factory=dict)
    run: Json = field(default_factory=dict)
    ledger_metadata: Mapping[str, str] = field(default_factory=dict)
    missing: Sequence[str] = ()
    guarantees: Mapping[str, Outcome] = field(default_factory=dict)
    charts: Sequence[HeightChart] = ()

    def without_ledger(self, why: str) -> RunData:
        """A copy with an empty ledger, for a file of which a column turns out to be unreadable."""
        missing = [*self.missing, f"{LEDGER}: unreadable: {why}"]
        return replace(self, ledger=FrameCopies.of_rows([]), missing=missing)

    @cached_property
    def nodes(self) -> list[str]:
        """Names of all nodes that occur in the scenario, the signals, the counters or the ledger, sorted."""
        declared = self.scenario.get("agents")
        named = set(declared) if isinstance(declared, dict) else set()
        named |= set(self.signals) - set(self.scenario.get("derived") or ()) | set(self.counters)
        named |= {node for link in self.ledger.link.names for node in link[1:]}
        return sorted(named - {""})

    @cached_property
    def media(self) -> list[str]:
        declared = self.scenario.get("media")
        named = set(declared) if isinstance(declared, dict) else set()
        return sorted(named | {link[0] for link in self.ledger.link.names})


def load_run(run_dir: Path) -> RunData:
    """Read the folder of a run; raises nothing for a part that is missing or unreadable."""
    missing: list[str] = []
    scenario = _json(SCENARIO, run_dir, missing)
    summary = _json(SUMMARY, run_dir, missing)
    run = _json(RUN, run_dir, missing)
    ledger, metadata = _ledger(run_dir / LEDGER, missing)
    recording = _recording(run_dir / SIGNALS, missing)
    if not scenario and recording.scenario:
        scenario = msgspec.json.decode(recording.scenario, type=Json)
    tables = with_deaths(recording.signals, run.get("dead_ns") or {})
    signals = derive(scenario.get("derived") or {}, tables, Path(scenario.get("path", "")).parent, missing)
    return RunData(_length_ns(scenario, run, ledger, recording), ledger, signals, run.get("counters") or {},
                   recording.events, scenario, summary, run, metadata, missing,
                   _guarantees(run_dir, missing) if scenario.get("guarantees") else {}, _charts(run_dir, missing))


def _length_ns(scenario: Json, run: Json, ledger: FrameCopies, recording: Recording) -> int:
    """The time that the run reached; if that is unknown, the scenario's length, or else the last instant on record."""
    for known in (run.get("reached_ns"), scenario.get("length_ns")):
        if isinstance(known, int):
            return known
    last = [int(table.time_ns[-1]) for table in recording.signals.values() if table.time_ns.size]
    with suppress(LedgerUnreadable):            # reported when the figures of frames are computed
        for column in ("offered_ns", "end_ns", "delivered_ns") if len(ledger) else ():
            last.append(int(ledger.ints(column).max()))
    return max(last, default=0)


def _json(file: JsonFile[Json], run_dir: Path, missing: list[str]) -> Json:
    try:
        return file.read(run_dir)
    except FileNotFoundError:
        missing.append(f"{file.name}: not there")
        return file.left(run_dir) or {}
    except (msgspec.MsgspecError, OSError) as error:
        missing.append(f"{file.name}: unreadable: {error}")
    return {}


def _guarantees(run_dir: Path, missing: list[str]) -> dict[str, Outcome]:
    try:
        found = GUARANTEES.read(run_dir)
    except FileNotFoundError:
        missing.append(f"{GUARANTEES.name}: not there, so no guarantee is judged")
    except (msgspec.MsgspecError, OSError) as error:
        missing.append(f"{GUARANTEES.name}: unreadable: {error}")
    else:
        return {outcome.standing.name: outcome for outcome in found}
    return {}


def _charts(run_dir: Path, missing: list[str]) -> Sequence[HeightChart]:
    try:
        return CHARTS.read(run_dir)
    except FileNotFoundError:
        return ()
    except (msgspec.MsgspecError, OSError) as error:
        missing.append(f"{CHARTS.name}: unreadable: {error}")
    return ()


def _ledger(path: Path, missing: list[str]) -> tuple[FrameCopies, dict[str, str]]:
    if not path.exists() and journal_of(path).exists():
        missing.append(f"{path.name}: not there (the run was killed); its journal is read as far as it goes")
    try:
        return FrameCopies.of_file(path), read_metadata(path)
    except FileNotFoundError:
        missing.append(f"{path.name}: not there, so nothing is known about frames")
    except (pa.ArrowException, OSError) as error:
        missing.append(f"{path.name}: unreadable (the run was killed before it closed the file): {error}")
    return FrameCopies.of_rows([]), {}


def _recording(path: Path, missing: list[str]) -> Recording:
    try:
        recording = read_recording(path)
    except OSError:
        missing.append(f"{path.name}: not there, so there are no signals and no events")
        return Recording()
    if not recording.whole:
        missing.append(f"{path.name}: cut off (the run was killed before it closed the file); read as far as it goes")
    return recording
