"""The folder of a campaign, and its rows: what has ended is in the journal at once, and is never run again.

    campaign.json     the plan: scenario, changes, settings, seeds, host
    runs.rows.part    a journal with a piece for each run that has ended, until all have
    runs.parquet      a row for each run: setting, seed, hash, verdict, every figure of `[expect]`
    report.html       what came out, with the worst runs
    runs/NUMBER/      records of runs that were repeated: failures, and the worst

A process that is killed, or a full disk, leaves the journal, readable up to its last whole piece; `--resume` goes on
from there. The lock is that of a run's folder (`experiments/run/run_folder.py`).
"""

from __future__ import annotations

import errno
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from experiments.judge.campaign import (
    CAMPAIGN,
    JOURNAL,
    METADATA,
    RUNS,
    Campaign,
    Plan,
    Row,
    figure_keys,
    read_plan,
    rows_of,
)
from experiments.judge.figures import Figures
from experiments.run.run_folder import FolderTaken, RunFolder
from experiments.sweep.messages import Point
from experiments.sweep.vary import BadCampaign
from netem.records.journal import Journal
from netem.records.part_file import part_of, publish, write_whole

FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class CannotKeep(OSError):
    """The disk has no room for the results of a campaign."""

    exit_code = 2


class Results:
    """The rows of the campaign in `folder`, which this process owns until `close`."""

    def __init__(self, folder: Path, plan: Plan, *, resume: bool) -> None:
        self.folder = folder
        self.plan = plan
        self.rows: dict[int, Row] = {}
        _refuse_other_content(folder)
        folder.mkdir(parents=True, exist_ok=True)
        self._owned = RunFolder.left(folder)
        try:
            self._open(resume)
        except BaseException:
            self._owned.release()
            raise

    def _open(self, resume: bool) -> None:
        there = (self.folder / CAMPAIGN).exists()
        if there and not resume:
            raise FolderTaken(f"{self.folder}: holds a campaign: go on with it by --resume (resume=True), or name "
                              "another folder with --out")
        if resume and there:
            self._take_earlier()
        write_whole(self.folder / CAMPAIGN, msgspec.json.encode(self.plan))
        self._journal = Journal(part_of(self.folder / JOURNAL))
        for row in self.rows.values():
            self._journal.add(msgspec.msgpack.encode(row))
        self._commit()
        part_of(self.folder / JOURNAL).replace(self.folder / JOURNAL)       # the old journal is there until now

    def _take_earlier(self) -> None:
        earlier = read_plan(self.folder)
        if difference := earlier.difference(self.plan):
            raise BadCampaign(f"--resume {self.folder}: holds another campaign: {difference}; name another folder with "
                              "--out, or ask for the same")
        place = {(row.setting, row.seed): row for row in rows_of(self.folder)}
        for number, (setting, seed) in enumerate(self.plan.pairs()):
            if found := place.get((setting, seed)):
                self.rows[number] = msgspec.structs.replace(found, number=number)

    def waiting(self) -> list[Point]:
        """Return the points that have not been run."""
        return [Point(number, self.plan.settings[setting], seed)
                for number, (setting, seed) in enumerate(self.plan.pairs()) if number not in self.rows]

    def add(self, point: Point, figures: Figures) -> Row:
        """Keep the figures of a run. CannotKeep on a full disk; what was kept before can be read."""
        row = Row(point.number, point.number // len(self.plan.seeds), figures)
        self.rows[point.number] = row
        self._journal.add(msgspec.msgpack.encode(row))
        self._commit()
        return row

    def _commit(self) -> None:
        try:
            self._journal.commit()
        except OSError as error:
            if error.errno not in FULL:
                raise
            raise CannotKeep(f"{self.folder}: cannot keep the results: {error.strerror}: free space, then go on with "
                             f"--resume; {len(self.rows) - 1} of {self.plan.runs} runs are kept") from None

    def write(self) -> Path:
        """Write `runs.parquet` from the rows so far; remove the journal if they are all."""
        path = self.folder / RUNS
        try:
            pq.write_table(self.table(), part_of(path), compression="zstd")
            publish(path)
        except OSError as error:
            part_of(path).unlink(missing_ok=True)
            if error.errno in FULL:
                raise CannotKeep(f"{path}: cannot be written: {error.strerror}: free space, then go on with --resume; "
                                 f"{len(self.rows)} of {self.plan.runs} runs are kept") from None
            raise
        if len(self.rows) == self.plan.runs:
            self._journal.close()
            (self.folder / JOURNAL).unlink(missing_ok=True)
        return path

    def table(self) -> pa.Table:
        rows = [self.rows[number] for number in sorted(self.rows)]
        columns: dict[str, pa.Array] = {
            "number": pa.array([row.number for row in rows], pa.int64()),
            "setting": pa.array([row.setting for row in rows], pa.int64()),
            "seed": pa.array([row.seed for row in rows], pa.uint64()),
            "ledger_hash": pa.array([row.figures.ledger_hash for row in rows], pa.string()),
            "holds": pa.array([row.figures.holds for row in rows], pa.bool_()),
            "failure": pa.array([row.figures.failure for row in rows], pa.string()),
        }
        for key in self.plan.varied:
            columns[key] = _column([self.plan.settings[row.setting][key] for row in rows])
        for key in figure_keys(self.plan, rows):
            columns[key] = pa.array([row.figures.values.get(key) for row in rows], pa.float64())
        columns["broken"] = pa.array([row.figures.broken for row in rows], pa.list_(pa.string()))
        columns["emulation_s"] = pa.array([row.figures.emulation_s for row in rows], pa.float64())
        columns["whole_s"] = pa.array([row.figures.whole_s for row in rows], pa.float64())
        return pa.table(columns, metadata={METADATA: msgspec.json.encode(self.plan)})

    def campaign(self) -> Campaign:
        return Campaign(self.folder, self.plan, [self.rows[number] for number in sorted(self.rows)])

    def close(self) -> None:
        with suppress(AttributeError):
            self._journal.close()
        self._owned.release()


def _column(values: Sequence[Any]) -> pa.Array:
    """Return values of one type as they are, numbers of two types as floats, and any others as JSON."""
    kinds = {type(value) for value in values}
    if kinds <= {int, float} and kinds != {int}:
        return pa.array([float(value) for value in values], pa.float64())
    if len(kinds) <= 1 and kinds <= {int, bool, str}:
        return pa.array(values)
    return pa.array([msgspec.json.encode(value).decode() for value in values], pa.string())


def _refuse_other_content(folder: Path) -> None:
    if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not (folder / CAMPAIGN).exists())):
        raise FileExistsError(f"--out {folder}: holds something else than a campaign; name a new folder")
