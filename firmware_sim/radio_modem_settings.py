"""The settings of a radio modem; source of the defaults: see `radio_modem`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

SECOND_NS: Final = 1_000_000_000
PACKET_BYTES: Final = 100
IDLE_BYTES: Final = 3


@dataclass(frozen=True)
class ModemSettings:
    serial: str                         # name of the port to the serial line
    radio: str                          # name of the port to the radio
    baud_bps: int                       # of the serial line
    bits_per_byte: int = 10
    packet_bytes: int = PACKET_BYTES    # size of a full packet, which is sent at once
    idle_bytes: int = IDLE_BYTES        # byte times of silence after which any packet is sent; 0: at once

    def __post_init__(self) -> None:
        if self.baud_bps < 1 or self.bits_per_byte < 1:
            raise ValueError(f"baud_bps={self.baud_bps}, bits_per_byte={self.bits_per_byte}: expected at least 1")
        if self.packet_bytes < 1:
            raise ValueError(f"packet_bytes={self.packet_bytes}: expected at least 1")
        if self.idle_bytes < 0:
            raise ValueError(f"idle_bytes={self.idle_bytes}: expected 0 (send at once) or more")

    @property
    def idle_ns(self) -> int:
        return -(-self.idle_bytes * self.bits_per_byte * SECOND_NS // self.baud_bps)
