"""The messages that a scenario declares for a bus, and whether the bus can carry them.

    utilization = sum of (longest frame with its intermission) / period

The longest frame has the worst stuffing that its length allows (`most_classical_bits`, `most_fd_bits`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from netem.media.can.bit_clock import BitClock
from netem.media.can.bus_timeline import INTERMISSION_BITS
from netem.media.can.encoded_frame import (
    AFTER_CRC_BITS,
    AFTER_FD_CRC_BITS,
    FD_CRC_FIELD_BITS,
    most_classical_bits,
    most_fd_bits,
    rank_of,
)
from netem.media.can.frame import EXTENDED_MASK, FD_LENGTHS, STANDARD_MASK, CanFrame
from netem.media.can.response_time import PeriodicMessage, response_time_ns

Bits = tuple[int, int]              # (at the nominal, at the data bit rate)


@dataclass(frozen=True)
class CanMessage:
    """One entry of `[media.<name>.messages]`."""

    id: int
    period_ns: int                          # least distance of its frames if it is not periodic
    sender: str
    length_bytes: int = 8
    extended: bool = False
    fd: bool = False
    bit_rate_switch: bool = True            # of CAN FD
    jitter_ns: int = 0
    deadline_ns: int | None = None          # None: the period

    def __post_init__(self) -> None:
        bits = 29 if self.extended else 11
        if not 0 <= self.id <= (EXTENDED_MASK if self.extended else STANDARD_MASK):
            raise ValueError(f"id={self.id:#x}: expected {bits} bits" + ("" if self.extended else "; or extended"))
        if self.fd and self.length_bytes not in FD_LENGTHS:
            raise ValueError(f"length_bytes={self.length_bytes}: CAN FD has {', '.join(map(str, FD_LENGTHS))}")
        if not self.fd and not 0 <= self.length_bytes <= 8:
            raise ValueError(f"length_bytes={self.length_bytes}: classical CAN carries 0 to 8; or set fd")
        if self.period_ns < 1:
            raise ValueError(f"period_ns={self.period_ns}: expected more than 0")
        if self.jitter_ns < 0:
            raise ValueError(f"jitter_ns={self.jitter_ns}: expected 0 or more")
        if self.deadline_ns is not None and self.deadline_ns < 1:
            raise ValueError(f"deadline_ns={self.deadline_ns}: expected more than 0")

    @property
    def rank(self) -> int:
        return rank_of(CanFrame(self.id, extended=self.extended))

    def most_bits(self) -> Bits:
        """Most bits from SOF to the end of EOF, with the worst stuffing."""
        if not self.fd:
            return most_classical_bits(self.length_bytes, extended=self.extended), 0
        nominal, data = most_fd_bits(self.length_bytes, extended=self.extended)
        return (nominal, data) if self.bit_rate_switch else (nominal + data, 0)

    def fewest_bits(self) -> Bits:
        """Fewest bits from SOF to the end of EOF: no stuff bits but the fixed ones."""
        if not self.fd:
            return (54 if self.extended else 34) + 8 * self.length_bytes + AFTER_CRC_BITS, 0
        nominal = (36 if self.extended else 17) + AFTER_FD_CRC_BITS
        data = 5 + 8 * self.length_bytes + FD_CRC_FIELD_BITS[self.length_bytes > 16] + 1
        return (nominal, data) if self.bit_rate_switch else (nominal + data, 0)


def by_priority(messages: Mapping[str, CanMessage]) -> dict[str, CanMessage]:
    return dict(sorted(messages.items(), key=lambda item: item[1].rank))


def periodic(messages: Mapping[str, CanMessage], clock: BitClock, *, worst: bool = True) -> list[PeriodicMessage]:
    """The messages for `response_time`, highest priority first, each with its `worst` or its shortest duration."""
    found = []
    for name, message in by_priority(messages).items():
        nominal, data = message.most_bits() if worst else message.fewest_bits()
        found.append(PeriodicMessage(name, clock.most_ns(nominal + INTERMISSION_BITS, data), message.period_ns,
                                     message.jitter_ns))
    return found


def response_times_ns(messages: Mapping[str, CanMessage], clock: BitClock) -> dict[str, int | None]:
    """Worst-case response time of each message, highest priority first, with a queue by priority; None if unbounded."""
    found = periodic(messages, clock)
    return {message.name: response_time_ns(found, index, clock.most_ns(1)) for index, message in enumerate(found)}


def late_messages(messages: Mapping[str, CanMessage], clock: BitClock) -> list[str]:
    """Describe each message whose worst-case response time exceeds its deadline, with a queue by priority."""
    lines = []
    for name, worst_ns in response_times_ns(messages, clock).items():
        declared = messages[name]
        deadline_ns = declared.deadline_ns or declared.period_ns
        if worst_ns is None or worst_ns > deadline_ns:
            reached = "has no bound" if worst_ns is None else f"is {worst_ns * 1e-6:.3f} ms"
            lines.append(f"{name} ({declared.id:#x}): worst-case response time {reached}, "
                         f"deadline {deadline_ns * 1e-6:.3f} ms")
    return lines
