"""A point-to-point UART: full duplex, with a transmit buffer at each end.

    write --room in the buffer?--> buffer --> shift register, byte by byte --> line --> chunk --> node
              no: QUEUE_FULL                  chunk: at the end of its last byte + receive latency

The bytes that a program sends in one call are one write. The buffer takes a write as a whole or refuses it, as drivers
of message protocols do that first ask for room. It is delivered at the end of its last byte, or in chunks of
`chunk_bytes`, each at the end of its own. A chunk is one frame of the ledger; `on_air_ns` is the start of its first
byte, `end_ns` the end of its last.

Invariants:
- bytes of one direction never overtake each other or overlap, and the line is never idle while bytes wait;
- the medium knows every arrival, and tells the links, when the buffer takes the write.

Bits above `data_bits` are not sent: they arrive as 0. There is no checksum: a corrupted chunk is delivered corrupt.

Not modelled: flow control, framing and parity errors (noise is an impairment), overrun of the receiver.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from random import Random
from typing import ClassVar, Final

from netem.core.agenda import Agenda
from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.media.links import Links
from netem.media.medium import Medium
from netem.media.serial_line.settings import SerialLineSettings
from netem.media.serial_line.transmitter import Transmitter
from netem.records.ledger import Ledger

COUNTERS: Final = ("bytes sent", "bytes refused")


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
        self._byte_ns = settings.clock.end_ns(1)
        self._chunk_bytes = settings.chunk_bytes
        self._latency_ns = settings.receive_latency_ns
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
        size = self._chunk_bytes or len(data)
        for start in range(0, len(data), size):
            chunk = data[start:start + size]
            end_ns = transmitter.end_ns(back=len(data) - start - len(chunk))
            frame = self._frame(sender, chunk, now_ns)
            frame.on_air_ns, frame.end_ns = begin_ns, end_ns
            self._links.receive(frame, self._other[sender], end_ns + self._latency_ns, checksum=False)
            for tap in self.taps:
                tap.frame(frame, end_ns)
            begin_ns = end_ns

    def lookahead_ns(self, t0_ns: int) -> int:
        """See `Medium`: the end of one more byte behind those that the same direction has to send already."""
        free_ns = min(transmitter.free_ns() for transmitter in self._transmitters.values())
        if free_ns <= t0_ns:
            return t0_ns + self._byte_ns + self._latency_ns
        return free_ns + self._byte_ns - 1 + self._latency_ns       # -1: the byte's end is rounded with its stretch

    def finish(self, end_ns: int) -> None:
        """Do nothing: the links close the copies that arrive after the end."""

    def _refuse(self, sender: str, data: bytes, now_ns: int, fate: Fate, cause: str) -> None:
        self._counters[sender]["bytes refused"] += len(data)
        self._ledger.close(self._frame(sender, data, now_ns), self._other[sender], fate, cause=cause)

    def _frame(self, sender: str, data: bytes, now_ns: int) -> Frame:
        frame = Frame(self.name, sender, self._numbers[sender], now_ns, data)
        self._numbers[sender] += 1
        self._ledger.expect(1, self.name)
        return frame
