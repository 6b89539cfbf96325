"""Logs of CAN buses, read with python-can: candump (`.log`), BLF, ASC, TRC and CSV, chosen by the file's ending.

Frames come as a `can` port takes them. python-can's readers pass over some lines that they do not know and raise errors
of many types for others; each becomes a `BadCanLog`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from math import isfinite
from pathlib import Path
from typing import IO, Any, Final, NamedTuple

import can

from netem.media.can.frame import CanFrame, pack

READERS: Final[Mapping[str, Callable[[Any], Iterable[can.Message]]]] = {
    ".log": can.CanutilsLogReader, ".blf": can.BLFReader, ".asc": can.ASCReader, ".trc": can.TRCReader,
    ".csv": can.CSVReader}
NS_PER_S: Final = 1e9
LATEST_S: Final = 9.2e9             # beyond it a time in ns has more than 63 bits


class LoggedFrame(NamedTuple):
    time_ns: int                    # as the log has it: from its start, or since 1970
    channel: str                    # "" in a log without channels
    data: bytes                     # as a `can` port has it; empty: an error frame


class BadCanLog(ValueError):
    """A file that is no log of a CAN bus, or a damaged one."""

    exit_code = 2


def read_can_log(path: Path) -> Iterator[LoggedFrame]:
    """Yield the frames of the log at `path` in the order of the file. Raises BadCanLog, OSError."""
    suffix = path.suffix.lower()
    if suffix not in READERS:
        raise BadCanLog(f"{path}: expected a log of a CAN bus whose name ends in one of {', '.join(READERS)}")
    number = 0
    try:
        with _opened(path, suffix) as file:             # a reader that raises leaves open what it has opened itself
            for message in READERS[suffix](file):
                number += 1
                yield LoggedFrame(_time_ns(message), "" if message.channel is None else str(message.channel),
                                  b"" if message.is_error_frame else pack(_frame(message)))
    except OSError:
        raise
    except Exception as error:      # of any type: python-can checks little of what it reads
        why = " ".join(str(error).split())[:200] or type(error).__name__
        raise BadCanLog(f"{path}: behind frame {number}: {why}: it is no {path.suffix} log of a CAN bus, or it was cut "
                        "off; keep the part before, or log anew") from error


def _opened(path: Path, suffix: str) -> IO[Any]:
    return path.open("rb") if suffix == ".blf" else path.open(encoding="utf-8", errors="replace")


def _time_ns(message: can.Message) -> int:
    if not isfinite(message.timestamp) or not 0 <= message.timestamp < LATEST_S:
        raise ValueError(f"a time of {message.timestamp} s")
    return round(message.timestamp * NS_PER_S)


def _frame(message: can.Message) -> CanFrame:
    data = bytes(message.data or b"")
    fd = message.is_fd or len(data) > 8             # CSV does not say
    return CanFrame(message.arbitration_id, b"" if message.is_remote_frame else data, message.is_extended_id,
                    message.is_remote_frame, fd, message.bitrate_switch, message.error_state_indicator,
                    message.dlc if message.is_remote_frame else -1)
