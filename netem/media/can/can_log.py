"""Logs of a CAN bus for CAN tools: candump (`.log`) and Vector's BLF (`.blf`).

python-can's writers write them, with seconds from the start of the run: candump in microseconds, BLF in nanoseconds. A
frame is logged once, at the instant at which receivers take it, an error frame when its first flag begins. The channel
is the name of the bus; in BLF, which allows only numbers, it is 0.

Not modelled: the sender of a frame (see the ledger).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Final

import can

from netem.core.frame import Frame
from netem.media.can.frame import unpack
from netem.media.can.settings import CanLogSettings
from netem.records import Feed, Place, Recorder
from netem.records.part_file import part_of, publish

NS_PER_S: Final = 1e9


class CanLog(Recorder):
    """Writes the frames of one bus before the end of the run to the file `<bus>.<SUFFIX>`."""

    Settings = CanLogSettings
    SUFFIX: ClassVar[str]

    def __init__(self, settings: CanLogSettings, place: Place) -> None:
        super().__init__(settings, place)
        self._path = place.folder / f"{settings.bus}.{self.SUFFIX}"
        self._writer = self._open(part_of(self._path), settings.bus)

    def _open(self, path: Path, bus: str) -> Any:
        """Return python-can's writer for the file."""
        raise NotImplementedError

    def record(self, run: Feed) -> None:
        run.frames[self.settings.bus].append(self)

    def frame(self, frame: Frame, seen_ns: int) -> None:
        seen = unpack(frame.data)
        length = len(seen.data) if not seen.remote else min(seen.dlc, 8)
        self._write(seen_ns, can.Message(
            timestamp=seen_ns / NS_PER_S, arbitration_id=seen.can_id, is_extended_id=seen.extended,
            is_remote_frame=seen.remote, is_fd=seen.fd, bitrate_switch=seen.bit_rate_switch,
            error_state_indicator=seen.error_state, dlc=length, data=seen.data))

    def error_frame(self, medium: str, time_ns: int) -> None:
        self._write(time_ns, can.Message(timestamp=time_ns / NS_PER_S, is_error_frame=True))

    def finish(self) -> None:
        """Close the file and give it its final name; BLF's writer adds its index here."""
        self._writer.stop()
        publish(self._path)

    def _write(self, time_ns: int, message: can.Message) -> None:
        if time_ns < self.place.end_ns:
            self._writer.on_message_received(message)


class Candump(CanLog):
    SUFFIX = "log"
    FILES = ("{medium}.log",)

    def _open(self, path: Path, bus: str) -> can.CanutilsLogWriter:
        return can.CanutilsLogWriter(path, channel=bus)


class Blf(CanLog):
    SUFFIX = "blf"
    FILES = ("{medium}.blf",)

    def _open(self, path: Path, bus: str) -> can.BLFWriter:
        writer = can.BLFWriter(path)
        writer.start_timestamp = 0.0    # otherwise the first message's, which BLF can express only as a date
        return writer
