"""Makes the records of a run that was killed: from its journals, up to the last piece that is whole.

    ledger.rows.part -> ledger.parquet              signals.rows.part -> signals.mcap, ledger_events.parquet
    run.json.part -> run.json, summary.json with the failure

What cannot be made (a disk that is still full) stays as a journal, and reports read the journal.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from experiments.judge.record_names import JOURNALS
from experiments.judge.run_result import Summary
from experiments.run.run_folder import RunFolder
from netem.records.events_file import write_events
from netem.records.journal import journal_of
from netem.records.ledger_file import hash_of, read_ledger, write_from_journal
from netem.records.part_file import part_of
from netem.records.signals import Recording, SignalFile, read_recording

KILLED = "the emulator's process was killed"


def is_unfinished(folder: Path) -> bool:
    """Whether a run began in `folder` that left no summary, or a record only as a journal."""
    if not (folder / "scenario.json").exists():
        return False
    return not (folder / "summary.json").exists() or any(part_of(folder / name).exists() for name in JOURNALS)


def complete(folder: Path, failure: str = KILLED, host: str = "") -> list[str]:
    """Make the records of the run in `folder`; returns what could not be made, and why.

    FolderTaken if the run still goes on.
    """
    owned = RunFolder.left(folder)
    try:
        return _complete(owned, failure, host)
    finally:
        owned.release()


def _complete(owned: RunFolder, failure: str, host: str) -> list[str]:
    folder = owned.path
    problems: list[str] = []
    scenario = _read(folder / "scenario.json")
    standing = _read(folder / "run.json") or _read(part_of(folder / "run.json"))
    names = {"scenario": str(scenario.get("name", "")), "seed": str(scenario.get("seed", ""))}

    def attempt(name: str, make: Callable[[], object]) -> None:
        try:
            make()
        except OSError as error:
            problems.append(f"{name}: {error.strerror or error}; what is in its journal can be read all the same")

    recording = read_recording(folder / "signals.mcap")
    attempt("ledger.parquet", lambda: _ledger(folder / "ledger.parquet", names))
    attempt("ledger_events.parquet", lambda: _events(folder / "ledger_events.parquet", recording))
    attempt("signals.mcap", lambda: _signals(folder, names, recording))
    if (folder / "summary.json").exists():
        return problems             # the run closed by itself, but had no room for all of its records
    ledger = read_ledger(folder / "ledger.parquet", ["fate", "offered_ns"])
    frames = {found["values"]: found["counts"] for found in ledger["fate"].combine_chunks().value_counts().to_pylist()}
    reached_ns = int(standing.get("reached_ns") or max(ledger["offered_ns"].to_pylist(), default=0))
    standing = {"counters": {}} | standing | {"reached_ns": reached_ns, "failure": failure}
    attempt("run.json", lambda: owned.run.write(msgspec.json.encode(standing)))
    summary = Summary(names["scenario"], str(scenario.get("question", "")), int(scenario.get("seed") or 0),
                      host, int(scenario.get("length_ns") or 0), 0.0, 0.0, 0.0, 0, 0,
                      hash_of(folder / "ledger.parquet"), frames, [], "report.html", failure=failure,
                      reached_ns=reached_ns)
    attempt("summary.json", lambda: owned.summary.write(msgspec.json.encode(summary)))
    return problems


def _ledger(path: Path, names: dict[str, str]) -> None:
    if not path.exists():
        write_from_journal(path, names | {"hash": hash_of(path)})


def _events(path: Path, recording: Recording) -> None:
    if not path.exists():
        write_events(path, recording.events)


def _signals(folder: Path, names: dict[str, str], recording: Recording) -> None:
    path, draft = folder / "signals.mcap", folder / "signals.again.mcap"
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
        recorder.finish(names, (folder / "scenario.json").read_bytes())
        draft.replace(path)
    finally:
        for left in (draft, part_of(draft), journal_of(draft)):
            left.unlink(missing_ok=True)
    journal_of(path).unlink(missing_ok=True)
    part_of(path).unlink(missing_ok=True)


def _read(path: Path) -> dict[str, Any]:
    with suppress(OSError, msgspec.MsgspecError):
        return msgspec.json.decode(path.read_bytes(), type=dict[str, Any])
    return {}
