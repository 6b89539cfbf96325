"""The keys of `[media.<name>]` for a CAN bus."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final, Literal

from netem.media.can.bit_clock import BitClock
from netem.media.can.bit_errors import BitErrorSettings
from netem.media.can.messages import CanMessage, periodic
from netem.media.can.response_time import utilization
from netem.media.can.transmit_queue import Discipline
from netem.topology import REFUSE_UNKNOWN_KEYS

FASTEST_NOMINAL_BPS: Final = 1_000_000      # ISO 11898-1:2015
FASTEST_DATA_BPS: Final = 8_000_000         # what transceivers carry (CiA 601-4)

SHORTEST_BITS: Final = ((44, 0), (26, 33))  # SOF to the end of EOF: a remote frame without stuff bits; CAN FD, no data

SHORTEST_ERROR_BITS: Final = 1 + 6 + 8 + 3  # SOF, error flag, error delimiter, intermission


@dataclass(frozen=True)
class CanSettings:
    __pydantic_config__: ClassVar = REFUSE_UNKNOWN_KEYS
    bit_rate_bps: int
    data_bit_rate_bps: int | None = None                    # of CAN FD; None: classical CAN only

    queue: Discipline = "priority"
    queue_frames: int = 32                                  # of each node
    own_frames_to: tuple[str, ...] = ()                     # nodes that hear their own frames when they got through
    error_messages_to: tuple[str, ...] = ()                 # nodes that their controller tells its changes of state

    at_bus_off: Literal["drop", "keep"] = "drop"            # what happens to the frames that wait
    recovery: Literal["automatic", "never"] = "automatic"   # from bus-off
    restart_delay_ns: int = 0                               # from bus-off to the start of the recovery

    bit_errors: BitErrorSettings = field(default_factory=BitErrorSettings)

    messages: dict[str, CanMessage] = field(default_factory=dict)
    messages_only: bool = False                             # any other frame is malformed
    overload: Literal["refuse", "report"] = "refuse"        # if the declared messages need more than there is

    load_window_ns: int = 100_000_000
    log: tuple[Literal["candump", "blf"], ...] = ()

    def __post_init__(self) -> None:
        if not 1 <= self.bit_rate_bps <= FASTEST_NOMINAL_BPS:
            raise ValueError(f"bit_rate_bps={self.bit_rate_bps}: expected 1 to {FASTEST_NOMINAL_BPS}")
        if self.data_bit_rate_bps is not None and not (
                self.bit_rate_bps <= self.data_bit_rate_bps <= FASTEST_DATA_BPS):
            raise ValueError(f"data_bit_rate_bps={self.data_bit_rate_bps}: expected bit_rate_bps={self.bit_rate_bps} "
                             f"to {FASTEST_DATA_BPS}")
        if self.queue_frames < 1:
            raise ValueError(f"queue_frames={self.queue_frames}: expected at least 1")
        if self.restart_delay_ns < 0:
            raise ValueError(f"restart_delay_ns={self.restart_delay_ns}: expected 0 or more")
        if self.load_window_ns < 1:
            raise ValueError(f"load_window_ns={self.load_window_ns}: expected more than 0")
        if self.messages_only and not self.messages:
            raise ValueError("messages_only=true: no messages are declared, so every frame would be malformed")
        self._check_messages()

    @property
    def clock(self) -> BitClock:
        return BitClock(self.bit_rate_bps, self.data_bit_rate_bps)

    def shortest_ns(self) -> int:
        """From a start to the earliest instant at which anything of it reaches a node: the frame when its last bit but
        one is over, a change of state at the end of an error frame with its intermission."""
        if self.messages_only:
            bits = [message.fewest_bits() for message in self.messages.values()]
        else:
            bits = list(SHORTEST_BITS[:1 if self.data_bit_rate_bps is None else 2])
        frame_ns = min(self.clock.whole_ns(nominal - 1, data) for nominal, data in bits)
        return min(frame_ns, self.clock.whole_ns(SHORTEST_ERROR_BITS)) if self.error_messages_to else frame_ns

    def check_nodes(self, medium: str, nodes: Sequence[str]) -> None:
        """Raise ValueError, one line a mistake, for names that are not those of `nodes`."""
        lines = []
        if medium in nodes:
            lines.append(f"the medium {medium} and a node on it have one name; rename one")
        there = f"no such node on this bus; there are {', '.join(nodes)}"
        for key in ("own_frames_to", "error_messages_to"):
            lines += [f"{key}={node}: {there}" for node in getattr(self, key) if node not in nodes]
        lines += [f"messages: {name}: sender={message.sender}: {there}" for name, message in self.messages.items()
                  if message.sender not in nodes]
        if lines:
            raise ValueError("\n".join(lines))

    def _check_messages(self) -> None:
        first: dict[int, str] = {}
        for name, message in self.messages.items():
            if message.fd and self.data_bit_rate_bps is None:
                raise ValueError(f"messages: {name} is CAN FD, which needs data_bit_rate_bps")
            other = first.setdefault(message.rank, name)
            if other != name:
                raise ValueError(f"messages: {other} and {name} have the same identifier {message.id:#x}: their frames "
                                 f"would collide; give each its own")
        worst = utilization(periodic(self.messages, self.clock))
        if worst > 1 and self.overload == "refuse":
            least = utilization(periodic(self.messages, self.clock, worst=False))
            raise ValueError(f"bit_rate_bps={self.bit_rate_bps}: the {len(self.messages)} declared messages need "
                             f"{worst:.1%} of it ({least:.1%} without stuff bits); raise it, lengthen periods, or set "
                             f"overload = \"report\" to run all the same")
