"""Plays a capture in the pcapng format, as `[records.pcapng]`, Wireshark and tcpdump write it.

    [agents.intruder]
    program = "firmware_sim.recorded.capture:CapturePlayer"
    parameters = { file = "frames.pcapng", interface = "radio", senders = ["r1"] }

The time of a packet in marconet's captures is that of its first bit on the air, so on a medium that is as idle as it
was the frames are on the air at equal instants. Packets of link type 227 are frames for a CAN bus; all others are
played as they are. Senders are known from the comments of marconet's captures.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from firmware_sim.recorded.log_player import LogPlayer, PlayerSettings, one_of
from netem.media.can.captured import LINK_TYPE as CAN
from netem.media.can.captured import offered
from netem.records.pcapng_file import Packet, read_packets

SENDER: Final = re.compile(r"sender=(\S+)")


@dataclass(frozen=True)
class CaptureSettings(PlayerSettings):
    """`interface` is one of the capture, by default its only one. No `senders`: all."""

    interface: str = ""
    senders: tuple[str, ...] = ()

    def chosen(self) -> Iterator[tuple[int, bytes]]:
        senders: dict[object, object] = {}
        for number, packet in enumerate(self._packets(), 1):
            found = SENDER.match(packet.comment)
            sender = found[1] if found else ""
            senders[sender] = None
            if self.senders and sender not in self.senders:
                continue
            if packet.link_type != CAN:
                yield packet.time_ns, packet.data
                continue
            try:
                data = offered(packet.data)
            except ValueError as error:
                raise ValueError(f"{self.file}: packet {number} of {packet.interface}: {error}: no frame of a CAN "
                                 "bus") from error
            if data is not None:
                yield packet.time_ns, data
        one_of("senders", self.senders, senders, self.file)

    def are_can_frames(self) -> bool:
        return any(packet.link_type == CAN for packet in self._packets())

    def _packets(self) -> Iterator[Packet]:
        there: dict[object, object] = {}
        for packet in read_packets(self.file):
            there[packet.interface] = None
            if not self.interface and len(there) > 1:
                raise ValueError(f"{self.file}: has packets of several interfaces, such as {', '.join(map(str, there))}"
                                 ": choose one, as interface = \"...\"")
            if self.interface in ("", packet.interface):
                yield packet
        if self.interface and there:
            one_of("interface", (self.interface,), there, self.file)


class CapturePlayer(LogPlayer):
    Settings = CaptureSettings
