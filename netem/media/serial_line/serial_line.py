"""A point-to-point UART: full duplex, with a transmit buffer at each end.

    write --room in the buffer?--> buffer --> shift register, byte by byte --> line --> chunk --> node
              no: QUEUE_FULL                  chunk: at the end of its last byte + receive latency

The bytes that a program sends in one call are one write. The buffer takes a write as a whole or refuses it, as drivers
of message protocols do that first ask for room. It is delivered at the end of its last byte, or in chunks of
`chunk_bytes`, each at the end of its own. A chunk is one frame of the ledger; `on_air_ns` is the start of its first
byte, `end_ns` the end of its last.

With `idle_bytes` the receiver is a UART with DMA: a chunk is what came until its buffer of `chunk_bytes` was full, or
until the line was idle for `idle_bytes` byte times, from one write or several. Then it is delivered, at that instant.

Invariants:
- bytes of one direction never overtake each other or overlap, and the line is never idle while bytes wait;
- without `idle_bytes` the medium knows every arrival, and tells the links, when the buffer takes the write;
- with it, a timer is set for each reception with bytes, at the instant at which the line will have been idle for long
  enough if nothing more comes.

Bits above `data_bits` are not sent: they arrive as 0. There is no checksum: a corrupted chunk is delivered corrupt.

Not modelled: flow control, framing and parity errors (noise is an impairment), overrun of the receiver.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from random import Random
from typing import ClassVar, Final

from mypy_extensions import mypyc_attr

from netem.core.agenda import TIMER, Agenda
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.media.links import Links
from netem.media.medium import Medium
from netem.media.serial_line.reception import Reception
from netem.media.serial_line.settings import SerialLineSettings
from netem.media.serial_line.transmitter import Transmitter
from netem.records.ledger import Ledger

COUNTERS: Final = ("bytes sent", "bytes refused")


@mypyc_attr(allow_interpreted_subclasses=True)
class SerialLine(Medium):
    Settings: ClassVar = SerialLineSettings

    def __init__(self, name: str, settings: SerialLineSettings, nodes: Iterable[str], agenda: Agenda, ledger: Ledger,
                 links: Links, rng_for: Callable[[str], Random]) -> None:
        super().__init__(name, nodes)
        ends = self.nodes
        settings.check_nodes(ends)
        self._ledger, self._links = ledger, links
        self._other = {ends[0]: ends[1], ends[1]: ends[0]}
        self._transmitters = {end: Transmitter(settings.clock, settings.buffer_bytes) for end in ends}
        self._clock = settings.clock
        self._byte_ns = settings.clock.end_ns(1)
        self._chunk_bytes = settings.chunk_bytes
        self._latency_ns = settings.receive_latency_ns
        self._agenda = agenda
        self._idle_ns = settings.clock.end_ns(settings.idle_bytes)
        self._receptions = {end: Reception() for end in ends} if settings.idle_bytes else {}    # by sender
        self._mask = (1 << settings.data_bits) - 1
        self._numbers: Counter[str] = Counter()
        self._counters: dict[str, Counter[str]] = {end: Counter(dict.fromkeys(COUNTERS, 0)) for end in ends}

    def counters(self) -> Mapping[str, Mapping[str, int]]:
        """Bytes sent and refused by each node; the names of the counters begin with that of the line."""
        return {end: {f"{self.name} {what}": count for what, count in found.items()}
                for end, found in self._counters.items()}

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        if not data:
            self._refuse(sender, data, now_ns, Fate.MALFORMED, "no bytes")
            return
        transmitter = self._transmitters[sender]
        room = transmitter.room(now_ns)
        if len(data) > room:
            self._refuse(sender, data, now_ns, Fate.QUEUE_FULL, f"{room} bytes free")
            return
        if self._mask != 0xFF:
            data = bytes(byte & self._mask for byte in data)
        begin_ns = transmitter.take(len(data), now_ns)
        self._counters[sender]["bytes sent"] += len(data)
        if self._receptions:
            self._receive(sender, data, begin_ns, now_ns)
            return
        size = self._chunk_bytes or len(data)
        for start in range(0, len(data), size):
            chunk = data[start:start + size]
            end_ns = transmitter.end_ns(back=len(data) - start - len(chunk))
            self._deliver(sender, chunk, now_ns, begin_ns, end_ns, end_ns + self._latency_ns)
            begin_ns = end_ns

    def lookahead_ns(self, t0_ns: int) -> int:
        """See `Medium`: the end of one more byte behind those that the same direction has to send already."""
        if self._receptions:
            return max(t0_ns, min(self._earliest_ns(end, t0_ns) for end in self._receptions)) + self._latency_ns
        free_ns = min(transmitter.free_ns() for transmitter in self._transmitters.values())
        if free_ns <= t0_ns:
            return t0_ns + self._byte_ns + self._latency_ns
        return free_ns + self._byte_ns - 1 + self._latency_ns       # -1: the byte's end is rounded with its stretch

    def finish(self, end_ns: int) -> None:
        """Close what waits for the idle line; the links close the copies that arrive after the end."""
        for sender, reception in self._receptions.items():
            if reception.data:
                frame = self._frame(sender, reception.data, reception.offered_ns)
                frame.on_air_ns, frame.end_ns = reception.begin_ns, reception.end_ns
                self._ledger.close(frame, self._other[sender], Fate.UNFINISHED, cause="the line was not idle yet")

    # --- a receiver that waits for the idle line

    def _receive(self, sender: str, data: bytes, begin_ns: int, now_ns: int) -> None:
        """Fill the receive buffer of the other end with a write whose first byte begins at `begin_ns`."""
        reception, transmitter = self._receptions[sender], self._transmitters[sender]
        rest = data
        while rest:
            room = self._chunk_bytes - len(reception.data) if self._chunk_bytes else len(rest)
            part, rest = rest[:room], rest[room:]
            end_ns = transmitter.end_ns(back=len(rest))
            reception.add(part, now_ns, begin_ns, end_ns)
            begin_ns = end_ns
            if len(reception.data) == self._chunk_bytes:
                self._hand_over(sender, end_ns)
        if reception.data:
            self._agenda.at(reception.end_ns + self._idle_ns, TIMER, self.name,
                            partial(self._idle, sender, reception.end_ns))

    def _idle(self, sender: str, end_ns: int) -> None:
        """Deliver what came until `end_ns`, unless more has come since."""
        reception = self._receptions[sender]
        if reception.data and reception.end_ns == end_ns:
            self._hand_over(sender, end_ns + self._idle_ns)

    def _hand_over(self, sender: str, at_ns: int) -> None:
        """Deliver the content of a receive buffer at `at_ns`."""
        reception = self._receptions[sender]
        self._deliver(sender, reception.data, reception.offered_ns, reception.begin_ns, reception.end_ns,
                      at_ns + self._latency_ns)
        reception.data = b""

    def _earliest_ns(self, sender: str, t0_ns: int) -> int:
        """Return the instant before which no more bytes of this end are handed over, if it writes from t0_ns on."""
        reception, free_ns = self._receptions[sender], self._transmitters[sender].free_ns()
        begin_ns = max(t0_ns, free_ns)
        idle_ns = (reception.end_ns if reception.data else begin_ns + self._byte_ns - 1) + self._idle_ns
        if not self._chunk_bytes:
            return idle_ns
        # -1: the end of a byte is rounded with its stretch
        return min(idle_ns, begin_ns + self._clock.end_ns(self._chunk_bytes - len(reception.data)) - 1)

    # --- both kinds of receivers

    def _deliver(self, sender: str, data: bytes, offered_ns: int, begin_ns: int, end_ns: int, arrival_ns: int) -> None:
        """Pass a chunk, on the line from `begin_ns` to `end_ns`, to the link."""
        frame = self._frame(sender, data, offered_ns)
        frame.on_air_ns, frame.end_ns = begin_ns, end_ns
        self._links.receive(frame, self._other[sender], arrival_ns, checksum=False)
        for tap in self.taps:
            tap.frame(frame, end_ns)

    def _refuse(self, sender: str, data: bytes, now_ns: int, fate: Fate, cause: str) -> None:
        self._counters[sender]["bytes refused"] += len(data)
        self._ledger.close(self._frame(sender, data, now_ns), self._other[sender], fate, cause=cause)

    def _frame(self, sender: str, data: bytes, now_ns: int) -> Frame:
        frame = Frame(self.name, sender, self._numbers[sender], now_ns, data)
        self._numbers[sender] += 1
        self._ledger.expect(1, self.name)
        return frame
