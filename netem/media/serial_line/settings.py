"""The keys of `[media.<name>]` for a serial line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Final, Literal

from netem.media import MediumSettings
from netem.media.answers import DatagramFormat, SerialFormat
from netem.media.serial_line.byte_clock import ByteClock

FASTEST_BPS: Final = 20_000_000     # limit of RS-485 transceivers; UARTs of microcontrollers reach 12.5 Mbit/s


@dataclass(frozen=True)
class SerialLineSettings(MediumSettings):
    link_type: ClassVar = 148               # USER1
    baud_bps: int
    data_bits: int = 8
    parity: Literal["none", "even", "odd"] = "none"
    stop_bits: int = 1
    buffer_bytes: int = 1024        # of each end's transmit buffer
    chunk_bytes: int = 0            # most bytes that the receiver gets at once; 0: no limit
    idle_bytes: int = 0             # byte times of silence after which the receiver gets what came; 0: it never waits
    receive_latency_ns: int = 0     # from the end of a chunk's last byte to the program

    def __post_init__(self) -> None:
        if not 1 <= self.baud_bps <= FASTEST_BPS:
            raise ValueError(f"baud_bps={self.baud_bps}: expected 1 to {FASTEST_BPS}")
        if not 5 <= self.data_bits <= 8:
            raise ValueError(f"data_bits={self.data_bits}: expected 5 to 8")
        if self.stop_bits not in (1, 2):
            raise ValueError(f"stop_bits={self.stop_bits}: expected 1 or 2")
        if self.buffer_bytes < 1:
            raise ValueError(f"buffer_bytes={self.buffer_bytes}: expected at least 1")
        if self.chunk_bytes < 0:
            raise ValueError(f"chunk_bytes={self.chunk_bytes}: expected 0 (no limit) or more")
        if self.idle_bytes < 0:
            raise ValueError(f"idle_bytes={self.idle_bytes}: expected 0 (deliver without waiting) or more")
        if self.receive_latency_ns < 0:
            raise ValueError(f"receive_latency_ns={self.receive_latency_ns}: expected 0 or more")

    @property
    def clock(self) -> ByteClock:
        return ByteClock(self.baud_bps, 1 + self.data_bits + (self.parity != "none") + self.stop_bits)

    def serial_format(self) -> SerialFormat:
        return SerialFormat(self.clock, self.chunk_bytes, self.idle_bytes)

    def datagram_format(self) -> DatagramFormat:
        return DatagramFormat(None, addressed=False, whole=False)

    def longest_frame_bytes(self) -> int:
        return self.buffer_bytes

    @staticmethod
    def check_nodes(nodes: Sequence[str]) -> None:
        """Raise ValueError unless the line has two ends."""
        if len(nodes) != 2:
            raise ValueError(f"a serial line has two ends, this one {len(nodes)}: {', '.join(nodes) or 'none'}; say in "
                             "`media` of each agent which lines it is on")
