"""The MACs that a scenario can name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from netem.media.mac import CarrierSense, Channel, Mac, StreamFor
from netem.media.mac.aloha import Aloha
from netem.media.mac.dcf import Dcf
from netem.media.mac.none import NoMac
from netem.media.mac.unslotted import Unslotted


def _csma(channel: Channel, queue_frames: int, sense: CarrierSense, rng_for: StreamFor) -> Mac:
    if sense.scheme == "dcf":
        return Dcf(channel, queue_frames, sense, rng_for)
    return Unslotted(channel, queue_frames, sense, rng_for)


MACS: Final[dict[str, Callable[[Channel, int, CarrierSense, StreamFor], Mac]]] = {
    "none": lambda channel, queue_frames, sense, rng_for: NoMac(channel),
    "aloha": lambda channel, queue_frames, sense, rng_for: Aloha(channel, queue_frames),
    "csma": _csma,
}
