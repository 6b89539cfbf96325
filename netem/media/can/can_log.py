"""Logs of a CAN bus for CAN tools: candump (`.log`), Vector's BLF and ASC, PEAK's TRC, and CSV.

python-can's writers write them, with seconds from the start of the run: candump, ASC and TRC in microseconds, BLF in
nanoseconds, CSV as a float. A frame is logged once, at the instant at which receivers take it, an error frame when its
first flag begins. The channel is the name of the bus; in BLF, ASC and TRC, which allow only numbers, it is 0 or 1. ASC
and TRC state a date, which is 1970-01-01, 00:00.

Not modelled: the sender of a frame (see the ledger). CSV does not say whether a frame is CAN FD; TRC has neither remote
nor error frames, nor CAN FD.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, ClassVar, Final

import can

from netem.core.frame import Frame
from netem.media.can.frame import unpack
from netem.media.can.settings import CanLogSettings
from netem.records import Carried, Feed, NoSuchFormat, Place, Recorder
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

    @classmethod
    def afterwards(cls, media: Mapping[str, Carried], chosen: str | None, asked: Any | None) -> Sequence[Any]:
        buses = [name for name, medium in media.items() if medium.carries_can_frames]
        there = f"the CAN buses are {', '.join(buses)}" if buses else "this run has no CAN bus"
        if chosen is not None and chosen not in buses:
            raise NoSuchFormat(f"{chosen}: a log of CAN frames is of a CAN bus, which {chosen} is not; {there}")
        if not buses:
            raise NoSuchFormat(f"a log of CAN frames is of a CAN bus; {there}")
        return [CanLogSettings(bus) for bus in ([chosen] if chosen is not None else buses)]

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


START: Final = "Thu Jan 01 00:00:00.000 1970"       # of the run, as ASC writes a date


class _AscWriter(can.ASCWriter):
    """python-can's writer, with the start of the run instead of the machine's date and of the first frame's time."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.header_written = True
        self.file.write(f"Begin Triggerblock {START}\n")
        self.log_event("Start of measurement", 0.0)

    def _format_header_datetime(self, dt: datetime) -> str:
        return START


class Asc(CanLog):
    SUFFIX = "asc"
    FILES = ("{medium}.asc",)

    def _open(self, path: Path, bus: str) -> can.ASCWriter:
        return _AscWriter(path)


class Trc(CanLog):
    SUFFIX = "trc"
    FILES = ("{medium}.trc",)

    def frame(self, frame: Frame, seen_ns: int) -> None:
        seen = unpack(frame.data)
        if seen.fd:
            raise NoSuchFormat(f"{frame.medium}: frame {frame.number} of {frame.sender} is CAN FD, which TRC has not; "
                               "use asc or blf")
        if not seen.remote:
            super().frame(frame, seen_ns)

    def error_frame(self, medium: str, time_ns: int) -> None:
        """Leave it out: python-can's writer has no error frames."""

    def _open(self, path: Path, bus: str) -> can.TRCWriter:
        writer = can.TRCWriter(path)
        writer.filepath = f"{bus}.{self.SUFFIX}"        # in its header, otherwise with the folder
        writer.first_timestamp = 0.0            # otherwise the first frame's
        writer.write_header(0.0)
        return writer


class Csv(CanLog):
    SUFFIX = "csv"
    FILES = ("{medium}.csv",)

    def _open(self, path: Path, bus: str) -> can.CSVWriter:
        return can.CSVWriter(path)
