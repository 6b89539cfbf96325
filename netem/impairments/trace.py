"""Loss and delay from a recording: a CSV file with one row per frame, or one row per interval of time.

    delay_ms,lost            by = "frame": row n is for the link's frame n
    12.5,0                   by = "time": the file also has time_s (or _ms, _us, _ns), strictly rising; a row holds on
    ,1                         [its time, the next row's time), the last one as long as the one before it

By time, the row in force at the instant at which a copy enters the link is used. The run starts at `start_ns` of the
file's clock, by default at the time of the first row, so a file may have times of an epoch.
Without a column `delay_*` no copy is delayed, without `lost` (or `received`) none is lost; the row of a lost copy needs
no delay. `columns` maps names to those that the file has instead: {"delay_ms": "rtt"}. Other columns are not read.
After its last row the trace starts again (`wrap`), keeps to that row (`hold`), or raises `TraceEnded` (`error`).

Not modelled: interpolation between rows, rate traces. A copy may overtake another one whose row has a longer delay.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from msgspec.structs import replace

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.flow import Flow
from netem.impairments.recordings import Recordings
from netem.impairments.trace_rows import LOST, read_rows


class TraceEnded(Exception):
    """A trace with `at_end = "error"` has no row for a frame."""

    exit_code = 2                       # a mistake of the user: the recording is too short


@dataclass
class Trace(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST

    file: str                                               # CSV; relative to the scenario's folder
    by: Literal["frame", "time"] = "frame"
    at_end: Literal["wrap", "hold", "error"] = "wrap"
    columns: dict[str, str] = field(default_factory=dict)   # name with unit -> name that `file` has instead
    start_ns: int | None = None                             # start of the run on the file's clock; None: its first row
    recordings: Recordings = field(default_factory=Recordings, kw_only=True, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.by not in ("frame", "time"):
            raise ValueError(f"by={self.by}: expected frame or time")
        if self.at_end not in ("wrap", "hold", "error"):
            raise ValueError(f"at_end={self.at_end}: expected wrap, hold or error")
        by_time = self.by == "time"
        if self.start_ns is not None and not by_time:
            raise ValueError(f"start_ns={self.start_ns}: belongs to by = \"time\"")
        key = ("trace", self.file, by_time, tuple(sorted(self.columns.items())), self.start_ns)
        rows = self.recordings.once(key, lambda: read_rows(self.file, by_time, self.columns, self.start_ns))
        self._delays_ns, self._times_ns, self._length = rows.delays_ns, rows.times_ns, rows.length
        self._least_ns, self._most_ns = rows.least_ns, rows.most_ns

    def carry(self, transit: Transit) -> Iterator[Transit]:
        place = transit.sent_ns if self.by == "time" else transit.number
        if place >= self._length:
            place = self._past_the_end(place)
        row = bisect_right(self._times_ns, place) - 1 if self.by == "time" else place
        delay_ns = self._delays_ns[row]
        if delay_ns != LOST:
            yield replace(transit, arrival_ns=transit.arrival_ns + delay_ns)

    def written_out(self) -> bool:
        return True

    def least_delay_ns(self, size_bytes: int) -> int:
        """The shortest delay of the recording."""
        return self._least_ns

    def most_delay_ns(self, flow: Flow) -> int:
        """The longest delay of the recording."""
        return self._most_ns

    def _past_the_end(self, place: int) -> int:
        if self.at_end == "wrap":
            return place % self._length
        if self.at_end == "hold":
            return self._length - 1
        what = f"{place} ns" if self.by == "time" else f"frame {place}"
        raise TraceEnded(f"{self.file}: {what} lies past the end ({self._length}{' ns' if self.by == 'time' else ''}): "
                         'record longer, or set at_end = "wrap" or "hold"')
