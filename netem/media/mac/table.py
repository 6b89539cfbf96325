"""The MACs that a scenario can name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from netem.media.mac import CarrierSense, Channel, Mac, StreamFor
from netem.media.mac.aloha import Aloha
from netem.media.mac.dcf import Dcf
from netem.media.mac.none import NoMac
from netem.media.mac.unslotted import Unslotted


def _csma(channel: Channel, queue_frames: int, sense: CarrierSense, rng_for: StreamFor) -> Mac:
    if sense.scheme == "dcf":
        return Dcf(channel, queue_frames, sense, rng_for)
    return Unslotted(channel, queue_frames, sense, rng_for)


class MacKind(NamedTuple):
    build: Callable[[Channel, int, CarrierSense, StreamFor], Mac]
    defers: bool = True         # a frame may start later than its program sent it


MACS: Final = {
    "none": MacKind(lambda channel, queue_frames, sense, rng_for: NoMac(channel), defers=False),
    "aloha": MacKind(lambda channel, queue_frames, sense, rng_for: Aloha(channel, queue_frames)),
    "csma": MacKind(_csma),
}
