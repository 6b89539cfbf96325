"""The recorders, by kind: those of every run, those that the settings of a medium request, and those of `[records]`."""

from __future__ import annotations

from typing import Final

from netem.core.kinds import Kinds

RECORDERS: Final = Kinds({
    "candump": "netem.media.can.can_log:Candump",
    "blf": "netem.media.can.can_log:Blf",
    "asc": "netem.media.can.can_log:Asc",
    "trc": "netem.media.can.can_log:Trc",
    "csv": "netem.media.can.can_log:Csv",
    "frames": "netem.records.frames_file:FrameRecorder",
    "pcapng": "netem.records.pcapng:PcapngRecorder",
    "tlog": "firmware_sim.mavlink.tlog:TlogRecorder",       # by name only, like each: MAVLink is known there
    "events": "netem.records.events_file:EventRecorder",
    "signals": "netem.records.signals:SignalRecorder",
})
IN_EVERY_RUN: Final = ("events", "signals")         # they end in this order
ASKED_BY_MEDIA: Final = ("candump", "blf", "asc", "trc", "csv")
FROM_FRAMES: Final = ("pcapng", "tlog", *ASKED_BY_MEDIA)    # written after a run too, if it kept its frames
