"""The bytes of every frame on the air, as `frames.parquet`: the recorder, and the reader.

One row for each frame that has been on the air, in the order in which media decided about frames, and one for the start
of each error frame of a CAN bus. `medium`, `sender` and `number` name the copies of the frame in the ledger.

    medium, sender      names; an error frame has no sender, ""
    number              of the frame, as in the ledger; -1 for an error frame
    offered_ns          the node handed the frame out
    on_air_ns, end_ns   first instant on the air, first instant after it
    seen_ns             a receiver has all of it; of an error frame, its start
    data                the bytes on the air

A frame is kept if `seen_ns` lies before the end of the run. File and journal, `frames.rows.part`, are those of
row_file.py; a run that was killed leaves the journal, which is read up to its last whole piece.

Not kept: frames that never were on the air, as those that a full queue dropped, and what a link changed in a copy.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import msgspec
import pyarrow as pa

from netem.core.frame import Frame
from netem.records import Feed, Place, Recorder
from netem.records.columns import NAME
from netem.records.journal import journal_of
from netem.records.row_file import RowFile, RowFormat
from netem.records.uninterrupted import uninterrupted

FILE: Final = "frames.parquet"
KIND: Final = "frames"                  # in `record = "frames"`
CHUNK_FRAMES: Final = 65_536
CHUNK_BYTES: Final = 16 << 20           # of frames in memory
BATCH: Final = 4096                     # frames read at once
SCHEMA: Final = pa.schema([
    pa.field("medium", NAME, nullable=False),
    pa.field("sender", NAME, nullable=False),
    *(pa.field(name, pa.int64(), nullable=False)
      for name in ("number", "offered_ns", "on_air_ns", "end_ns", "seen_ns")),
    pa.field("data", pa.binary(), nullable=False),
])
FORMAT: Final = RowFormat(SCHEMA)


class KeptFrame(NamedTuple):
    """A row of the file: the bytes `data` of one frame, or an error frame, which has number -1 and no bytes."""

    medium: str
    sender: str
    number: int
    offered_ns: int
    on_air_ns: int
    end_ns: int
    seen_ns: int
    data: bytes


class FrameRecorder(Recorder):
    """Keeps the frames of every medium."""

    FILES = (FILE,)

    def __init__(self, settings: Any, place: Place) -> None:
        super().__init__(settings, place)
        self._file = RowFile(place.folder / FILE, FORMAT, place.metadata)
        self._encode = msgspec.msgpack.Encoder().encode
        self._rows: list[KeptFrame] = []
        self._kept = 0                  # the first `_kept` of `_rows` are in the journal
        self._bytes = 0
        self._end_ns = place.end_ns
        self._finished = False

    def record(self, run: Feed) -> None:
        for taps in run.frames.values():
            taps.append(self)

    def frame(self, frame: Frame, seen_ns: int) -> None:
        if seen_ns < self._end_ns:
            self._rows.append(KeptFrame(frame.medium, frame.sender, frame.number, frame.offered_ns, frame.on_air_ns,
                                        frame.end_ns, seen_ns, frame.data))
            self._bytes += len(frame.data)
            if len(self._rows) >= CHUNK_FRAMES or self._bytes >= CHUNK_BYTES:
                self._flush()

    def error_frame(self, medium: str, time_ns: int) -> None:
        if time_ns < self._end_ns:
            self._rows.append(KeptFrame(medium, "", -1, time_ns, time_ns, time_ns, time_ns, b""))

    def keep(self) -> None:
        """Write the frames so far to the journal. On OSError, as for a full disk, they wait for the next call."""
        with uninterrupted():
            unkept = self._unkept()
            self._kept = len(self._rows)
            if unkept:
                self._file.note(unkept)

    def finish(self) -> None:
        if self._finished:
            return
        self._finished = True
        unkept = self._unkept()
        if self._rows:
            self._file.write(self._rows)
        self._rows = []
        self._file.finish(unkept)

    def _unkept(self) -> bytes:
        return self._encode(self._rows[self._kept:]) if self._kept < len(self._rows) else b""

    def _flush(self) -> None:
        self.keep()
        with uninterrupted():
            self._file.write(self._rows)
            self._rows, self._kept, self._bytes = [], 0, 0


class NoFrames(ValueError):
    """A run has not kept the bytes of its frames, or the file of them is damaged."""

    exit_code = 2


def has_frames(folder: Path) -> bool:
    """Return whether the run in `folder` has kept its frames, in the file or in the journal of a killed run."""
    return (folder / FILE).is_file() or journal_of(folder / FILE).is_file()


def frame_table(folder: Path) -> pa.Table:
    """Return the frames that the run in `folder` kept, with the columns of `SCHEMA`, in the order of their rows.

    Raises NoFrames if it kept none or the file is damaged.
    """
    if not has_frames(folder):
        raise NoFrames(f"{folder}: the run kept no bytes of its frames: write `record = \"frames\"` at the top of its "
                       "scenario, before its tables, and run it again")
    try:
        table = FORMAT.read(folder / FILE).select(SCHEMA.names)
        table.validate(full=True)
        return table.cast(SCHEMA)
    except (pa.ArrowException, KeyError, OSError, msgspec.MsgspecError, ValueError) as error:
        why = " ".join(str(error).split())[:200]
        raise NoFrames(f"{folder / FILE}: cannot be read ({why}): it is damaged or another program's; run the scenario "
                       "again") from error


def frames_of(table: pa.Table) -> Iterator[KeptFrame]:
    """Yield the rows of a table of frames."""
    for batch in table.to_batches(max_chunksize=BATCH):
        yield from map(KeptFrame._make, zip(*(column.to_pylist() for column in batch.columns), strict=True))
