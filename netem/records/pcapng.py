"""A capture of every medium for Wireshark, `frames.pcapng`: the recorder.

    frames.parquet, ledger.parquet --at the end of the run--> one packet for each frame, in the order of its first bit

Each medium is an interface with its name. The time of a packet is that of the first bit on the air, in ns from the
start of the run; Wireshark shows it as a time of 1970. Its bytes are those on the air, with the link type of the medium
(`MediumSettings.link_type`): 227 for CAN, 147 to 151 for others, which `marconet.lua` beside the file dissects. Its
comment says who sent it, when, and what became of each copy:

    sender=r1 number=12 slot=3 offered_ns=100 on_air_ns=120 end_ns=150 seen_ns=150 | r2: delivered at 160 ns
    | r3: lost (impairments[0] scripted_loss) | r4 copy 1: delivered at 170 ns

A fate is settled after the arrival, later than the packet's time, so the file is written after the run, from the frames
and the ledger: each packet is then in its place and has all of its fates (decision 0049).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from netem.core.nearest import did_you_mean
from netem.records import Carried, Feed, Recorder
from netem.records.frame_fates import CopyFate, FrameFates
from netem.records.frames_file import KIND as FRAMES
from netem.records.frames_file import KeptFrame, frame_table, frames_of
from netem.records.journal import GrowingFile
from netem.records.part_file import part_of, publish, write_whole
from netem.records.pcapng_file import Interface, PcapngWriter

FILE: Final = "frames.pcapng"
DISSECTOR: Final = "marconet.lua"
LEDGER: Final = "ledger.parquet"
COMMIT_EVERY: Final = 4096              # packets


@dataclass(frozen=True)
class PcapngSettings:
    """`media` are those to capture, by default all. A `slot_ns` of more than 0 numbers slots of that length from 0."""

    media: tuple[str, ...] = ()
    slot_ns: int = 0

    def __post_init__(self) -> None:
        if self.slot_ns < 0:
            raise ValueError(f"slot_ns={self.slot_ns}: expected 0 or more")


class PcapngRecorder(Recorder):
    """Writes the capture and the dissector."""

    Settings = PcapngSettings
    FILES = (FILE, DISSECTOR)
    NEEDS = (FRAMES,)

    @classmethod
    def check(cls, settings: PcapngSettings, media: Mapping[str, Carried]) -> Iterable[str]:
        for name in settings.media:
            if name not in media:
                yield f"media={name}: no such medium; " + did_you_mean(name, media, f"there are {', '.join(media)}")

    @classmethod
    def afterwards(cls, media: Mapping[str, Carried], chosen: str | None, asked: Any | None) -> Sequence[Any]:
        settings = asked or PcapngSettings()
        return [settings if chosen is None else replace(settings, media=(chosen,))]

    def record(self, run: Feed) -> None:
        """Nothing: the frames are those of the recorder `frames`."""

    def finish(self) -> None:
        path, media = self.place.folder / FILE, self.place.media
        table, fates = frame_table(self.place.recorded), FrameFates(self.place.recorded / LEDGER)
        captured = [name for name in media if not self.settings.media or name in self.settings.media]
        interfaces = {name: number for number, name in enumerate(captured)}
        in_order = table.take(np.argsort(table["on_air_ns"].to_numpy(), kind="stable"))
        stream = GrowingFile(part_of(path))
        try:
            writer = PcapngWriter(stream, [Interface(name, media[name].link_type) for name in captured])
            for count, frame in enumerate(frames_of(in_order), 1):
                if frame.medium in interfaces:
                    writer.packet(interfaces[frame.medium], frame.on_air_ns, media[frame.medium].captured(frame.data),
                                  self._comment(frame, fates))
                if not count % COMMIT_EVERY:
                    stream.commit()
            stream.commit()
        except OSError:
            part_of(path).unlink(missing_ok=True)
            raise
        finally:
            stream.close()
        publish(path)
        write_whole(self.place.folder / DISSECTOR, Path(__file__).with_name(DISSECTOR).read_bytes())

    def _comment(self, frame: KeptFrame, fates: FrameFates) -> str:
        if not frame.sender:
            return f"error frame on {frame.medium}"
        slot_ns = self.settings.slot_ns
        slot = f" slot={frame.on_air_ns // slot_ns}" if slot_ns else ""
        head = (f"sender={frame.sender} number={frame.number}{slot} offered_ns={frame.offered_ns} "
                f"on_air_ns={frame.on_air_ns} end_ns={frame.end_ns} seen_ns={frame.seen_ns}")
        return " | ".join((head, *map(_in_words, fates.of(frame.medium, frame.sender, frame.number))))


def _in_words(copy: CopyFate) -> str:
    name = f"{copy.receiver} copy {copy.copy}" if copy.copy else copy.receiver
    at = f" at {copy.delivered_ns} ns" if copy.delivered_ns >= 0 else ""
    cause = f" ({copy.cause.replace('|', '/')})" if copy.cause else ""
    return f"{name}: {copy.fate}{at}{cause}"

