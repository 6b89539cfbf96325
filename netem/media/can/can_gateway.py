"""A bus of python-can as a gateway to an emulated CAN bus: what comes from outside takes part in its arbitration.

    outside frame --> the gateway's controller on the emulated bus --arbitration--> all other nodes
    frame on the emulated bus --> the outside bus

Any interface of python-can can be named. An error message that the emulated bus has for the gateway
(`error_messages_to`) leaves as python-can's error frame, if the interface has any; an error frame from outside becomes
one of the emulated bus if that names the gateway in `error_frames_from`.

Not modelled: acknowledgements between the two buses, and arbitration against what waits outside.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final

from netem.core.nearest import did_you_mean
from netem.gateways import UNREAD, Datagrams, Gateway, GatewaySettings, Tell, tell_nobody
from netem.gateways.allowance import Allowance
from netem.gateways.reconnection import Reconnection, wrong_times
from netem.media.can.frame import unpack
from netem.media.can.outside_bus import CARRY_ERRORS, OutsideBus, interfaces
from netem.wire.instants import NEVER_NS

USUAL_OPTIONS: Final[Mapping[str, Mapping[str, Any]]] = {"udp_multicast": {"hop_limit": 0}}   # stays on this machine
SHARED: Final = ("socketcan", "socketcand", "udp_multicast", "virtual")     # several may open one channel
OWN: Final = "marconet"             # the interface of programs within a run


@dataclass(frozen=True)
class CanGatewaySettings(GatewaySettings):
    interface: str                      # of python-can: udp_multicast, slcan, socketcand, socketcan, virtual, ...
    channel: str | None = None          # None: the interface's default
    fd: bool = False                    # send and receive CAN FD
    bit_rate_bps: int | None = None     # to which a device is set; None: it is not
    data_bit_rate_bps: int | None = None
    options: dict[str, Any] = field(default_factory=dict)       # further arguments of `can.Bus`
    retry_ns: int = 500_000_000         # from a lost bus to the first attempt to open it again
    retry_longest_ns: int = 5_000_000_000
    most_per_s: int = 20_000            # frames from outside; those beyond are dropped

    def __post_init__(self) -> None:
        wrong = []
        known = interfaces()
        if self.interface == OWN:
            wrong.append(f"interface={OWN}: is that of programs within a run; name one that leads outside, such as "
                         "\"udp_multicast\"")
        elif self.interface not in known:
            wrong.append(f"interface={self.interface}: no such interface of python-can; "
                         + did_you_mean(self.interface, known, f"there are {', '.join(sorted(known))}"))
        if self.most_per_s < 1:
            wrong.append(f"most_per_s={self.most_per_s}: expected at least 1")
        wrong += [f"options: {key} is a key of the gateway; write it beside options" for key in self.options
                  if key in ("interface", "channel", "fd", "bitrate", "data_bitrate")]
        wrong += wrong_times(self.retry_ns, self.retry_longest_ns)
        if wrong:
            raise ValueError("\n".join(wrong))

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `can.Bus`."""
        own = {"interface": self.interface, "channel": self.channel, "fd": self.fd, "bitrate": self.bit_rate_bps,
               "data_bitrate": self.data_bit_rate_bps}
        return {**{key: value for key, value in own.items() if value is not None},
                **USUAL_OPTIONS.get(self.interface, {}), **self.options}

    def occupies(self) -> Collection[str]:
        return () if self.interface in SHARED else (f"the channel {self.channel} of {self.interface}",)

    def refusal(self, *, carries_can_frames: bool, datagrams: Datagrams | None) -> str:
        return "" if carries_can_frames else "carries no CAN frames; name a medium of the kind can"


class CanGateway(Gateway):
    """A gateway to a bus outside.

    Invariants:
    - `received + flooded` is the number of frames from outside that are no echo of the gateway's own;
    - "frames sent" and "frames not sent", with those that wait, are the number of calls of `send`.
    """

    Settings: ClassVar = CanGatewaySettings
    settings: CanGatewaySettings

    def __init__(self, name: str, medium: str, settings: CanGatewaySettings, *, event: Tell = tell_nobody,
                 longest_bytes: int | None = None, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """Open the bus, or plan to open it again if that fails."""
        super().__init__(name, medium, settings, event=event, longest_bytes=longest_bytes, clock_ns=clock_ns)
        self.received = self.flooded = 0
        self._allowance = Allowance(settings.most_per_s, clock_ns())
        self._unsent = 0
        self._told_fd = False
        self._runs = False
        self._outside = OutsideBus(settings.arguments(), Reconnection(settings.retry_ns, settings.retry_longest_ns))

    def fileno(self) -> int:
        return self._outside.fileno()

    def due_ns(self) -> int:
        return NEVER_NS if self._runs else 0        # the first wait of the run starts the threads

    def receive(self, most: int) -> list[bytes]:
        if not self._runs:
            self._runs = True
            self._outside.start()
        outside, now_ns = self._outside, self._clock_ns()
        outside.take()
        while outside.notes:
            self.tell(*outside.notes.popleft())
        found: list[bytes] = []
        while outside.heard and len(found) < most:
            data = outside.heard.popleft()
            if self._allowance.take(now_ns):
                found.append(data)
                continue
            self.flooded += 1
            self.tell_flood(self._allowance, f"the bus outside sends more than {self.settings.most_per_s} frames a "
                            "second; those beyond are dropped and counted; raise most_per_s if it is as fast")
        self.received += len(found)
        if outside.heard:
            outside.wake()
        return found

    def send(self, data: bytes) -> None:
        frame = unpack(data)
        if (frame.error and self.settings.interface not in CARRY_ERRORS) or (frame.fd and not self.settings.fd):
            self._unsent += 1
            if frame.fd and not self._told_fd:
                self._told_fd = True
                self.tell(UNREAD, "drops CAN FD frames, as the bus outside was opened without CAN FD: set fd = true")
            return
        self._outside.send(frame)

    def counters(self) -> dict[str, int]:
        outside = self._outside
        return {"frames received": self.received, "frames beyond the rate": self.flooded + outside.overflowed,
                "no CAN frames": outside.garbage, "frames sent": outside.sent,
                "frames not sent": outside.unsent + outside.waiting + self._unsent, "connections": outside.connections}

    def close(self) -> None:
        self._outside.close()
