"""The keys of `[media.<name>]` for a CAN bus."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar, Final, Literal

from netem.media import MediumSettings, Shown
from netem.media.can.bit_clock import BitClock
from netem.media.can.bit_errors import BitErrorSettings
from netem.media.can.captured import captured
from netem.media.can.dbc_file import read_dbc
from netem.media.can.dbc_messages import declared_by
from netem.media.can.messages import CanMessage, by_priority, periodic, response_times_ns
from netem.media.can.response_time import utilization
from netem.media.can.transmit_queue import Discipline

FASTEST_NOMINAL_BPS: Final = 1_000_000      # ISO 11898-1:2015
FASTEST_DATA_BPS: Final = 8_000_000         # limit of transceivers (CiA 601-4)

SHORTEST_BITS: Final = ((44, 0), (26, 33))  # SOF to the end of EOF: a remote frame without stuff bits; CAN FD, no data

SHORTEST_LOSS_BITS: Final = 2                # SOF and the first bit of the identifier
SHORTEST_ERROR_BITS: Final = 1 + 6 + 8 + 3  # SOF, error flag, error delimiter, intermission


@dataclass(frozen=True)
class CanLogSettings:
    bus: str


@dataclass(frozen=True)
class CanSettings(MediumSettings):
    carries_can_frames: ClassVar = True
    link_type: ClassVar = 227                               # CAN_SOCKETCAN
    strikable: ClassVar = frozenset({"links", "bus"})
    bit_rate_bps: int
    data_bit_rate_bps: int | None = None                    # of CAN FD; None: classical CAN only

    queue: Discipline = "priority"
    queue_frames: int = 32                                  # of each node
    own_frames_to: tuple[str, ...] = ()                     # nodes that receive their own frames after transmission
    error_messages_to: tuple[str, ...] = ()                 # nodes that get messages about their controller's state
    notifications_to: tuple[str, ...] = ()                  # FMUs that get Confirm, Arbitration Lost and Bus Error
    error_frames_from: tuple[str, ...] = ()                 # nodes that may offer an error message: it is an error flag

    at_bus_off: Literal["drop", "keep"] = "drop"            # treatment of the frames that wait
    recovery: Literal["automatic", "never"] = "automatic"   # from bus-off
    restart_delay_ns: int = 0                               # from bus-off to the start of the recovery

    bit_errors: BitErrorSettings = field(default_factory=BitErrorSettings)

    messages: dict[str, CanMessage] = field(default_factory=dict)
    dbc: Path | None = None                                 # a DBC file that declares further messages
    dbc_nodes: dict[str, str] = field(default_factory=dict)     # the file's names of control units -> nodes of the bus
    dbc_signals: tuple[str, ...] = ()                       # MESSAGE.SIGNAL of the file to record, patterns allowed
    messages_only: bool = False                             # frames that are no declared message are malformed
    overload: Literal["refuse", "report"] = "refuse"        # if the declared messages need more than the bit rate

    load_window_ns: int = 100_000_000
    log: tuple[Literal["candump", "blf", "asc", "trc", "csv"], ...] = ()

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
        if "trc" in self.log and self.data_bit_rate_bps is not None:
            raise ValueError("log: \"trc\" has no frames of CAN FD, which data_bit_rate_bps allows; use \"asc\" or "
                             "\"blf\"")
        if self.load_window_ns < 1:
            raise ValueError(f"load_window_ns={self.load_window_ns}: expected more than 0")
        if self.messages_only and not self.messages and self.dbc is None:
            raise ValueError("messages_only=true: no messages are declared, so every frame would be malformed")
        if self.dbc_signals and self.dbc is None:
            raise ValueError("dbc_signals: no DBC file says what the frames mean; give its path as dbc")
        self._check_messages()

    @staticmethod
    def captured(data: bytes) -> bytes:
        return captured(data)

    def with_declared(self, nodes: Sequence[str]) -> CanSettings:
        """Return the settings with the messages of the DBC file added to `messages`, whose own entries take precedence.

        Raises DbcError, or ValueError if the messages need more than the bit rate.
        """
        if self.dbc is None:
            return self
        own = {message.rank for message in self.messages.values()}
        found = declared_by(read_dbc(self.dbc), nodes, self.dbc_nodes).messages
        return replace(self, dbc=None, dbc_signals=(), messages=self.messages | {
            name: message for name, message in found.items() if name not in self.messages and message.rank not in own})

    def shown(self, medium: str, nodes: Sequence[str]) -> list[Shown]:
        """Tables of the declared messages, with load and worst-case response times, and of those passed over."""
        settings, clock = self.with_declared(nodes), self.clock
        tables = []
        if settings.messages:
            worst, least = (utilization(periodic(settings.messages, clock, worst=worst)) for worst in (True, False))
            reached = response_times_ns(settings.messages, clock)
            tables.append(Shown(
                f"{medium}: declared messages need {least:.1%} to {worst:.1%} of the bus",
                ("message", "identifier", "sender", "period", "worst-case response", "deadline"),
                [(name, f"{message.id:#x}", message.sender, _ms(message.period_ns), _ms(reached[name]),
                  _ms(message.deadline_ns or message.period_ns))
                 for name, message in by_priority(settings.messages).items()]))
        if self.dbc is not None:
            passed_over = declared_by(read_dbc(self.dbc), nodes, self.dbc_nodes).passed_over
            if passed_over:
                tables.append(Shown(f"{medium}: passed over in {self.dbc.name}", ("message", "why"),
                                    list(passed_over.items())))
        return tables

    def recorders(self, medium: str) -> Mapping[str, object]:
        return {kind: CanLogSettings(medium) for kind in self.log}

    def reports_own_frames_to(self, node: str) -> bool:
        return node in self.own_frames_to

    def notifies(self, node: str) -> bool:
        return node in self.notifications_to

    @property
    def clock(self) -> BitClock:
        return BitClock(self.bit_rate_bps, self.data_bit_rate_bps)

    def shortest_ns(self) -> int:
        """Shortest time from the start of a transmission to the first message of it that reaches a node.

        Receivers take a frame at the end of its last bit but one; a controller reports a change of state at the end of
        an error frame with its intermission. With notifications, a controller reports a lost arbitration after the
        second bit at the earliest.
        """
        if self.messages_only:
            bits = [message.fewest_bits() for message in self.messages.values()]
        else:
            bits = list(SHORTEST_BITS[:1 if self.data_bit_rate_bps is None else 2])
        frame_ns = min(self.clock.whole_ns(nominal - 1, data) for nominal, data in bits)
        if self.notifications_to:
            return self.clock.whole_ns(SHORTEST_LOSS_BITS)
        return min(frame_ns, self.clock.whole_ns(SHORTEST_ERROR_BITS)) if self.error_messages_to else frame_ns

    def check_nodes(self, medium: str, nodes: Sequence[str]) -> None:
        """Raise ValueError, one line a mistake, for names that are not those of `nodes`."""
        lines = []
        if medium in nodes:
            lines.append(f"the medium {medium} and a node on it have one name; rename one")
        there = f"no such node on this bus; there are {', '.join(nodes)}"
        for key in ("own_frames_to", "error_messages_to", "notifications_to", "error_frames_from"):
            lines += [f"{key}={node}: {there}" for node in getattr(self, key) if node not in nodes]
        lines += [f"messages: {name}: sender={message.sender}: {there}" for name, message in self.messages.items()
                  if message.sender not in nodes]
        lines += [f"dbc_nodes: {unit}={node}: {there}" for unit, node in self.dbc_nodes.items() if node not in nodes]
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


def _ms(time_ns: int | None) -> str:
    return "no bound" if time_ns is None else f"{time_ns * 1e-6:.6g} ms"
