"""What went over a CAN bus as the logs that CAN tools read: candump (`.log`) and Vector's BLF (`.blf`).

Written by python-can's own writers, so time is in seconds from the start of the run as they print it: candump with
microseconds, BLF with nanoseconds. A frame is logged when its receivers take it, once, whoever they are; an error frame
when its first flag begins. The channel is the name of the bus; BLF knows numbers only and has 0.

Not modelled: who sent a frame (the ledger knows).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import can

from netem.media.can.frame import unpack
from netem.records.part_file import part_of, publish
from netem.wire.instants import NEVER_NS

NS_PER_S: Final = 1e9
SUFFIX: Final = {"candump": "log", "blf": "blf"}


def _candump(path: Path, bus: str) -> can.CanutilsLogWriter:
    return can.CanutilsLogWriter(path, channel=bus)


def _blf(path: Path, bus: str) -> can.BLFWriter:
    writer = can.BLFWriter(path)
    writer.start_timestamp = 0.0        # else the first message's, which BLF cannot say unless it is a date
    return writer


_WRITERS: Final[dict[str, Callable[[Path, str], can.CanutilsLogWriter | can.BLFWriter]]] = {
    "candump": _candump, "blf": _blf}


class CanLog:
    """The files `<bus>.log` and `<bus>.blf` of `folder`; nothing from `end_ns` on is logged."""

    def __init__(self, folder: Path, bus: str, formats: Sequence[str], end_ns: int = NEVER_NS) -> None:
        self._end_ns = end_ns
        self._paths = [folder / f"{bus}.{SUFFIX[name]}" for name in formats]
        self._writers = [_WRITERS[name](part_of(path), bus) for name, path in zip(formats, self._paths, strict=True)]

    def frame(self, time_ns: int, data: bytes) -> None:
        frame = unpack(data)
        length = len(frame.data) if not frame.remote else min(frame.dlc, 8)
        self._write(time_ns, can.Message(
            timestamp=time_ns / NS_PER_S, arbitration_id=frame.can_id, is_extended_id=frame.extended,
            is_remote_frame=frame.remote, is_fd=frame.fd, bitrate_switch=frame.bit_rate_switch,
            error_state_indicator=frame.error_state, dlc=length, data=frame.data))

    def error_frame(self, time_ns: int) -> None:
        self._write(time_ns, can.Message(timestamp=time_ns / NS_PER_S, is_error_frame=True))

    def finish(self) -> None:
        """Close the files, which have their names only now; BLF has its index only now as well."""
        for writer, path in zip(self._writers, self._paths, strict=True):
            writer.stop()
            publish(path)

    def _write(self, time_ns: int, message: can.Message) -> None:
        if time_ns < self._end_ns:
            for writer in self._writers:
                writer.on_message_received(message)
