"""MAVLink telemetry logs (`.tlog`) of a run, for ground stations and pymavlink's tools: the recorder and the reader.

    record: microseconds since 1970 (uint64, big endian), then one MAVLink frame                    any number of them

For each node two files: `MEDIUM.NODE.sent.tlog` has what the node sent, at the first bit on the air, and
`MEDIUM.NODE.heard.tlog` what reached it from all others, at its arrival. What the first file of one node has and the
second of another has not was lost on the way. Time is that of the run, whose start is 1970, in whole us.

A frame of the medium may hold several MAVLink frames or, on a serial line, a part of one; its time is then that of its
last part. Left out are copies of the fate `delivered corrupt`, of which the records have only the original bytes.

A node without a MAVLink frame has no file. Source: the format is that of mavlogdump.py and MAVProxy.
Not modelled: MAVLink 1, messages that are not in common.xml (see framing.py).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from struct import Struct
from typing import Any, Final, NamedTuple

import numpy as np

from firmware_sim.mavlink.framing import FrameReader
from netem.core.fate import Fate
from netem.core.nearest import did_you_mean
from netem.records import Carried, Feed, NoSuchFormat, Recorder
from netem.records.frame_fates import FrameFates
from netem.records.frames_file import KIND as FRAMES
from netem.records.frames_file import frame_table, frames_of
from netem.records.part_file import write_whole

LEDGER: Final = "ledger.parquet"
STAMP: Final = Struct(">Q")
HEADS: Final = {0xFD: 12, 0xFE: 8}              # first byte -> bytes of a frame besides payload and signature
SIGNED, SIGNATURE_BYTES = 0x01, 13
LATEST_US: Final = (1 << 63) // 1000            # beyond it a time in ns has more than 63 bits


@dataclass(frozen=True)
class TlogSettings:
    """`media` are those whose MAVLink frames are logged, by default all that can carry any."""

    media: tuple[str, ...] = ()


class TlogRecorder(Recorder):
    """Writes the logs after the run, from its frames and its ledger."""

    Settings = TlogSettings
    FILES = ("{medium}.{node}.sent.tlog", "{medium}.{node}.heard.tlog")
    NEEDS = (FRAMES,)

    @classmethod
    def check(cls, settings: TlogSettings, media: Mapping[str, Carried]) -> Iterable[str]:
        for name in settings.media:
            if name not in media:
                yield f"media={name}: no such medium; " + did_you_mean(name, media, f"there are {', '.join(media)}")
            elif not _can_carry(media[name]):
                yield f"media={name}: {_why_not(name, media)}"

    @classmethod
    def afterwards(cls, media: Mapping[str, Carried], chosen: str | None, asked: Any | None) -> Sequence[Any]:
        if chosen is not None and not _can_carry(media[chosen]):
            raise NoSuchFormat(f"{chosen}: {_why_not(chosen, media)}")
        return [(asked or TlogSettings()) if chosen is None else TlogSettings((chosen,))]

    def record(self, run: Feed) -> None:
        """Nothing: the frames are those of the recorder `frames`."""

    def finish(self) -> None:
        table, fates = frame_table(self.place.recorded), FrameFates(self.place.recorded / LEDGER)
        media = self.settings.media or [name for name, medium in self.place.media.items() if _can_carry(medium)]
        sent: dict[tuple[str, str], _Log] = {}
        heard: dict[tuple[str, str], list[tuple[int, int, str, bytes]]] = {}
        in_order = table.take(np.argsort(table["on_air_ns"].to_numpy(), kind="stable"))
        for count, frame in enumerate(frames_of(in_order)):
            if frame.medium in media:
                sent.setdefault((frame.medium, frame.sender), _Log()).add(frame.sender, frame.on_air_ns, frame.data)
                for copy in fates.of(frame.medium, frame.sender, frame.number):
                    if copy.fate == Fate.DELIVERED.value:
                        heard.setdefault((frame.medium, copy.receiver), []).append(
                            (copy.delivered_ns, count, frame.sender, frame.data))
        for (medium, node), log in sent.items():
            self._write(f"{medium}.{node}.sent.tlog", log)
        for (medium, node), arrived in heard.items():
            log = _Log()
            for delivered_ns, _, sender, data in sorted(arrived):
                log.add(sender, delivered_ns, data)
            self._write(f"{medium}.{node}.heard.tlog", log)

    def _write(self, name: str, log: _Log) -> None:
        if log.content:
            write_whole(self.place.folder / name, bytes(log.content))


class _Log:
    """The content of one file; the bytes of each sender are a stream of their own."""

    def __init__(self) -> None:
        self.content = bytearray()
        self._readers: dict[str, FrameReader] = {}

    def add(self, sender: str, time_ns: int, data: bytes) -> None:
        for found in self._readers.setdefault(sender, FrameReader()).read(data):
            self.content += STAMP.pack(time_ns // 1000) + found.unsigned + found.signature


def _can_carry(medium: Carried) -> bool:
    return not (medium.carries_can_frames or medium.shows_bodies)


def _why_not(name: str, media: Mapping[str, Carried]) -> str:
    others = [other for other, medium in media.items() if _can_carry(medium)]
    what = "a CAN bus" if media[name].carries_can_frames else "a sensing medium"
    there = f"name one of {', '.join(others)}" if others else "this run has no other medium"
    return f"{name} is {what}, which carries no MAVLink; {there}"


class Logged(NamedTuple):
    time_ns: int                # since 1970
    system: int
    component: int
    data: bytes                 # one MAVLink frame


class BadLog(ValueError):
    """A file that is no telemetry log, or a damaged one."""

    exit_code = 2


def read_tlog(path: Path) -> Iterator[Logged]:
    """Yield the frames of the log at `path`, MAVLink 1 and 2, in the order of the file. Raises BadLog, OSError."""
    content = path.read_bytes()
    at, number = 0, 0
    while at < len(content):
        start = at + STAMP.size
        head = content[start:start + 10]
        if len(head) < 6 or head[0] not in HEADS:
            raise _damaged(path, number, at, "expected a time and a MAVLink frame")
        size = HEADS[head[0]] + head[1]
        if head[0] == 0xFD and head[2] & SIGNED:
            size += SIGNATURE_BYTES
        data = content[start:start + size]
        if len(data) < size:
            raise _damaged(path, number, at, f"{len(data)} bytes of a frame of {size}")
        time_us, = STAMP.unpack_from(content, at)
        if time_us > LATEST_US:
            raise _damaged(path, number, at, f"a time of {time_us} us")
        addressed = data[5:7] if data[0] == 0xFD else data[3:5]
        yield Logged(time_us * 1000, addressed[0], addressed[1], data)
        at, number = start + size, number + 1


def _damaged(path: Path, number: int, at: int, why: str) -> BadLog:
    return BadLog(f"{path}: behind frame {number}, at byte {at}: {why}: it is no MAVLink telemetry log (.tlog), or it "
                  "was cut off; `mavlogdump.py` shows what can be read")
