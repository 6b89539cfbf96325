"""Makes the records of a run that was killed, from its journals up to the last whole piece.

    ledger.rows.part -> ledger.parquet              signals.rows.part -> signals.mcap, ledger_events.parquet
    frames.rows.part -> frames.parquet -> files of the recorders of [records] that are made from it
    run.json.part -> run.json, summary.json with the failure

A record that cannot be made (the disk is still full) remains as a journal, which reports can read.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from experiments.judge.run_files import JOURNALS, LEDGER, RUN, SCENARIO, SUMMARY
from experiments.judge.run_result import Summary
from experiments.run.export import export_frames
from experiments.run.run_folder import RunFolder
from netem.records import events_file, frames_file, signals
from netem.records.events_file import write_events
from netem.records.journal import journal_of
from netem.records.ledger_file import hash_of, read_ledger, write_from_journal
from netem.records.part_file import part_of
from netem.records.signals import Recording, SignalFile, read_recording
from netem.records.table import RECORDERS

KILLED = "the emulator's process was killed"


def is_unfinished(folder: Path) -> bool:
    """Return whether a run in `folder` has left no summary, or a record only as a journal."""
    if not SCENARIO.is_in(folder):
        return False
    return not SUMMARY.is_in(folder) or any(part_of(folder / name).exists() for name in JOURNALS)


def complete(folder: Path, failure: str = KILLED, host: str = "") -> list[str]:
    """Make the records of the run in `folder`; return a line for each that could not be made, with the reason.

    Raises FolderTaken if the run is still in progress.
    """
    owned = RunFolder.left(folder)
    try:
        problems = _complete(owned.path, failure, host)
    finally:
        owned.release()
    return problems + write_requested(folder)


def _complete(folder: Path, failure: str, host: str) -> list[str]:
    problems: list[str] = []
    scenario = SCENARIO.left(folder) or {}
    standing = RUN.left(folder) or {}
    names = {"scenario": str(scenario.get("name", "")), "seed": str(scenario.get("seed", ""))}

    def attempt(name: str, make: Callable[[], object]) -> None:
        try:
            make()
        except OSError as error:
            problems.append(f"{name}: {error.strerror or error}; what is in its journal can be read all the same")

    recording = read_recording(folder / signals.FILE)
    attempt(LEDGER, lambda: _ledger(folder / LEDGER, names))
    attempt(events_file.FILE, lambda: _events(folder / events_file.FILE, recording))
    attempt(signals.FILE, lambda: _signals(folder, names, recording))
    if frames_file.has_frames(folder):
        attempt(frames_file.FILE, lambda: _frames(folder / frames_file.FILE, names))
    if SUMMARY.is_in(folder):
        return problems             # the run closed by itself, but had no room for all of its records
    ledger = read_ledger(folder / LEDGER, ["fate", "offered_ns"])
    frames = {found["values"]: found["counts"] for found in ledger["fate"].combine_chunks().value_counts().to_pylist()}
    reached_ns = int(standing.get("reached_ns") or max(ledger["offered_ns"].to_pylist(), default=0))
    standing = {"counters": {}} | standing | {"reached_ns": reached_ns, "failure": failure}
    attempt(RUN.name, lambda: RUN.write(folder, standing))
    summary = Summary(names["scenario"], str(scenario.get("question", "")), int(scenario.get("seed") or 0),
                      host, int(scenario.get("length_ns") or 0), 0.0, 0.0, 0.0, 0, 0,
                      hash_of(folder / LEDGER), frames, [], "report.html", failure=failure,
                      reached_ns=reached_ns)
    attempt(SUMMARY.name, lambda: SUMMARY.write(folder, summary))
    return problems


def write_requested(folder: Path) -> list[str]:
    """Write what `[records]` asked for and is made from kept frames; return a line for each that cannot be made."""
    requested = (SCENARIO.left(folder) or {}).get("records", {})
    problems: list[str] = []
    for kind in requested:
        if kind in RECORDERS and RECORDERS[kind].NEEDS:
            try:
                export_frames(folder, kind, None, folder)
            except (OSError, ValueError) as error:
                problems.append(f"{kind}: {error}")
    return problems


def _frames(path: Path, names: dict[str, str]) -> None:
    if not path.exists():
        frames_file.FORMAT.write_from_journal(path, names)


def _ledger(path: Path, names: dict[str, str]) -> None:
    if not path.exists():
        write_from_journal(path, names | {"hash": hash_of(path)})


def _events(path: Path, recording: Recording) -> None:
    if not path.exists():
        write_events(path, recording.events)


def _signals(folder: Path, names: dict[str, str], recording: Recording) -> None:
    path, draft = folder / signals.FILE, folder / "signals.again.mcap"
    if path.exists():
        return
    recorder = SignalFile(draft)
    try:
        for node, table in recording.signals.items():
            recorder.declare(node, list(zip(table.names, table.units, strict=True)))
            for time_ns, values in zip(table.time_ns.tolist(), table.values.tolist(), strict=True):
                recorder.append(node, time_ns, values)
        for event in recording.events:
            recorder.event(event)
        recorder.finish(names, (folder / SCENARIO.name).read_bytes())
        draft.replace(path)
    finally:
        for left in (draft, part_of(draft), journal_of(draft)):
            left.unlink(missing_ok=True)
    journal_of(path).unlink(missing_ok=True)
    part_of(path).unlink(missing_ok=True)
