"""Loss and delay from a recording: a CSV file with one row per frame, or one row per interval of time.

    delay_ms,lost            by = "frame": row n is for the link's frame n
    12.5,0                   by = "time": the file also has time_s (or _ms, _us, _ns), from 0, strictly rising; a row
    13.1,1                     holds on [its time, the next row's time), the last one as long as the one before it

`delay_*` and `lost` (0 or 1) may each be missing: no delay, no loss. Past the end the trace starts again (`wrap`), its
last row holds (`hold`), or the run stops with `TraceEnded` (`error`). Time is when the copy entered the link.

Not modelled: interpolation between rows, rate traces. A copy may overtake another, as its row says.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, Literal

from msgspec.structs import replace

from netem.fate import Fate
from netem.impairments.csv_columns import RecordingError, read_columns
from netem.transit import Transit


class TraceEnded(Exception):
    """A trace with `at_end = "error"` has no row for a frame."""

    exit_code = 2                       # what the user gave is too short


@dataclass
class Trace:
    loses_as: ClassVar[Fate] = Fate.LOST

    file: str                                               # CSV; the scenario loader resolves it beside the scenario
    by: Literal["frame", "time"] = "frame"
    at_end: Literal["wrap", "hold", "error"] = "wrap"

    def __post_init__(self) -> None:
        if self.by not in ("frame", "time"):
            raise ValueError(f"by={self.by}: expected frame or time")
        if self.at_end not in ("wrap", "hold", "error"):
            raise ValueError(f"at_end={self.at_end}: expected wrap, hold or error")
        columns = read_columns(self.file, times=["time", "delay"], ratios=["lost"])
        if "delay_ns" not in columns and "lost" not in columns:
            raise RecordingError(f"{self.file}:1: neither delay_s (or _ms, _us, _ns) nor lost: expected one")
        rows = len(next(iter(columns.values())))
        lost = columns.get("lost", [0.0] * rows)
        delays_ns = columns.get("delay_ns", [0] * rows)
        if any(value not in (0, 1) for value in lost):
            raise RecordingError(f"{self.file}: lost: expected 0 or 1 in every row")
        self._delay_ns = [None if gone else int(delay) for gone, delay in zip(lost, delays_ns, strict=True)]
        self._times_ns: list[int] = []
        self._length = rows                                 # frames, or ns
        if self.by == "time":
            if "time_ns" not in columns:
                raise RecordingError(f"{self.file}:1: by=time needs a column time_s, time_ms, time_us or time_ns")
            self._times_ns = [int(value) for value in columns["time_ns"]]
            self._check_times()
            self._length = 2 * self._times_ns[-1] - self._times_ns[-2]

    def _check_times(self) -> None:
        times_ns = self._times_ns
        if times_ns[0] != 0:
            raise RecordingError(f"{self.file}:2: time starts at {times_ns[0]} ns: expected 0")
        if len(times_ns) < 2:
            raise RecordingError(f"{self.file}: by=time needs two rows or more")
        falls = [row for row, (a, b) in enumerate(pairwise(times_ns)) if b <= a]
        if falls:
            raise RecordingError(f"{self.file}: row {falls[0] + 2}: time does not rise")

    def carry(self, transit: Transit) -> Iterator[Transit]:
        place = transit.sent_ns if self.by == "time" else transit.number
        if place >= self._length:
            place = self._past_the_end(place)
        row = bisect_right(self._times_ns, place) - 1 if self.by == "time" else place
        delay_ns = self._delay_ns[row]
        if delay_ns is not None:
            yield replace(transit, arrival_ns=transit.arrival_ns + delay_ns)

    def least_delay_ns(self, size_bytes: int) -> int:
        """No copy that comes out does so earlier than this after it went in."""
        return min((delay_ns for delay_ns in self._delay_ns if delay_ns is not None), default=0)

    def _past_the_end(self, place: int) -> int:
        if self.at_end == "wrap":
            return place % self._length
        if self.at_end == "hold":
            return self._length - 1
        what = f"{place} ns" if self.by == "time" else f"frame {place}"
        raise TraceEnded(f"{self.file}: {what} lies past the end ({self._length}{' ns' if self.by == 'time' else ''}): "
                         'record longer, or set at_end = "wrap" or "hold"')
