"""The rows of recorded loss and delay that `trace` replays.

Time 0 is `start_ns` on the file's clock, by default the time of its first row. The row in force at `start_ns` holds
from 0 on; rows before it are left out.

Invariant: rows do not change after construction, so all links with one recording share them.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from netem.impairments.csv_text import RecordingError

if TYPE_CHECKING:
    import numpy as np

    from netem.impairments.csv_columns import Columns

LOST = -1                               # stands for the delay of a lost copy


@dataclass(frozen=True)
class TraceRows:
    delays_ns: array[int]               # by row, LOST where the copy is lost
    times_ns: array[int]                # instant from which a row holds; empty if row n is for frame n
    length: int                         # of the recording, in frames or ns
    least_ns: int                       # shortest delay of a copy that is not lost; 0 if all are
    most_ns: int                        # longest one


def read_rows(file: str, by_time: bool, columns: Mapping[str, str], start_ns: int | None) -> TraceRows:
    """Read a recording; raises `RecordingError` if columns are missing, times do not rise, or `start_ns` is outside."""
    import numpy as np  # late: a scenario without recordings needs no numpy

    from netem.impairments.csv_columns import read_columns

    found = read_columns(file, times=["time", "delay"], flags=True, columns=columns)
    if "delay" not in found.times_ns and found.lost is None:
        raise RecordingError(f"{file}: neither delay_s (or _ms, _us, _ns) nor lost (or received) among "
                             f"{found.text.there}: expected one, or its name in the file in `columns`")
    delays_ns = found.times_ns.get("delay", np.zeros(found.rows, dtype=np.int64))
    if found.lost is not None:
        delays_ns = np.where(found.lost, LOST, delays_ns)
    times_ns = _times(found, file, start_ns) if by_time else np.zeros(0, dtype=np.int64)
    length = found.rows
    if by_time:
        length = int(2 * times_ns[-1] - times_ns[-2])
        first = int(np.searchsorted(times_ns, 0, "right")) - 1
        if first < 0 or length <= 0:
            raise RecordingError(f"start_ns={start_ns}: expected an instant within {file}, which begins "
                                 f"at {int(times_ns[0]) + (start_ns or 0)} ns and ends at {length + (start_ns or 0)}"
                                 " ns")
        delays_ns, times_ns = delays_ns[first:], np.maximum(times_ns[first:], 0)
    coming_out = delays_ns[delays_ns != LOST]
    return TraceRows(array("q", delays_ns.astype("=i8").tobytes()), array("q", times_ns.astype("=i8").tobytes()),
                     length, int(coming_out.min()) if len(coming_out) else 0,
                     int(coming_out.max()) if len(coming_out) else 0)


def _times(found: Columns, file: str, start_ns: int | None) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    import numpy as np

    if "time" not in found.times_ns:
        raise RecordingError(f"{file}: by=time needs a column time_s, time_ms, time_us or time_ns, or its name in the "
                             f"file in `columns`; there are {found.text.there}")
    times_ns = found.times_ns["time"]
    if len(times_ns) < 2:
        raise RecordingError(f"{file}: by=time needs two rows or more: the last one holds as long as the one before it")
    falls = np.flatnonzero(np.diff(times_ns) <= 0)
    if len(falls):
        row = int(falls[0]) + 1
        raise RecordingError(f"{file}:{found.line(row)}: the time does not rise: {times_ns[row]} ns after "
                             f"{times_ns[row - 1]} ns; sort the rows and keep one of each instant")
    return times_ns - (times_ns[0] if start_ns is None else start_ns)
