"""Gateways to streams of bytes (TCP connections, serial devices): what was read at once is one message.

    bytes from a peer --as many as were there, at most `longest_bytes`--> a message to the medium
    frame from the medium --> the peer's buffer, whole or not at all --> bytes to the peer, as it takes them

A peer's connection may end within a message in either direction. What came is passed on as it is: the receiver on the
medium sees an incomplete frame, as behind a cable that was pulled out. What was not sent yet is dropped with the
connection and counted, so the next connection begins with a whole message.

A peer that does not read has room for MOST_UNSENT_BYTES; then whole messages are dropped and counted, which is told
once. A peer that sends more than its allowance is told once and not read for a while: its system makes it wait.
"""

from __future__ import annotations

import selectors
import time
from abc import abstractmethod
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any, Final, Protocol

from netem.gateways import UNREAD, Gateway, Tell, tell_nobody
from netem.gateways.allowance import Allowance
from netem.wire.instants import NEVER_NS

READ_BYTES: Final = 4096
MOST_UNSENT_BYTES: Final = 1_000_000


class Channel(Protocol):
    """A file to the outside that never blocks."""

    def fileno(self) -> int: ...

    def read(self, most: int) -> bytes | None:
        """Return the bytes that are there, None if there are none, b"" at the end. Raises OSError if it is broken."""

    def write(self, data: bytes) -> int:
        """Return how many bytes were taken. Raises OSError if it is broken."""

    def close(self) -> None: ...


class StreamPeer:
    def __init__(self, name: str, channel: Channel, allowance: Allowance) -> None:
        self.name = name
        self.channel = channel
        self.allowance = allowance
        self.unsent: deque[bytes] = deque()     # the first of them may be the rest of a message
        self.unsent_bytes = 0
        self.writes = False                     # waits until it can be written
        self.reads = True                       # False while its allowance is used up
        self.told_unread = False
        self.broken = False                     # it takes no more, and will be seen to have ended when it is read


class StreamGateway(Gateway):
    """Base class of gateways to streams.

    Invariants:
    - a peer gets whole messages only, in order, until its connection ends;
    - `messages_sent + messages_unsent` is the number of (frame, peer), where a frame without any peer counts once.
    """

    def __init__(self, name: str, medium: str, settings: Any, *, event: Tell = tell_nobody,
                 longest_bytes: int | None = None, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        super().__init__(name, medium, settings, event=event, longest_bytes=longest_bytes, clock_ns=clock_ns)
        self.bytes_received = self.messages_received = self.bytes_sent = self.messages_sent = self.messages_unsent = 0
        self.connections = 0
        self._chunk_bytes = min(READ_BYTES, longest_bytes or READ_BYTES)
        self._selector = selectors.DefaultSelector()
        self._peers: list[StreamPeer] = []          # the one that was read last at the end

    # --- what a member says

    @abstractmethod
    def lost(self, peer: StreamPeer, why: str) -> None:
        """Note that the connection of a peer has ended, or could not be used; its channel is closed already."""

    def attend(self, now_ns: int) -> None:
        """Do what is due besides reading and writing: connect, accept."""

    def next_ns(self) -> int:
        """Return the instant at which `attend` is to be called whatever happens."""
        return NEVER_NS

    # --- as a gateway

    def fileno(self) -> int:
        return self._selector.fileno()

    def due_ns(self) -> int:
        paused_ns = [peer.allowance.due_ns() for peer in self._peers if not peer.reads]
        return min(self.next_ns(), *paused_ns) if paused_ns else self.next_ns()

    def receive(self, most: int) -> list[bytes]:
        now_ns = self._clock_ns()
        self.attend(now_ns)
        for peer in self._peers:
            if not peer.reads and peer.allowance.due_ns() <= now_ns:
                peer.reads = True
                self._watch(peer)
        found: list[bytes] = []
        readable: list[StreamPeer] = []
        for key, mask in self._selector.select(0):
            peer = key.data
            if isinstance(peer, StreamPeer):
                if mask & selectors.EVENT_WRITE:
                    self._flush(peer)
                if mask & selectors.EVENT_READ and peer.reads:
                    readable.append(peer)
        readable = [peer for peer in self._peers if peer in readable]
        while readable and len(found) < most:
            for peer in list(readable):
                if len(found) == most:
                    break
                data = self._read(peer, now_ns)
                if data is not None:
                    found.append(data)
                    self._peers.remove(peer)
                    self._peers.append(peer)
                if data is None or not peer.reads:
                    readable.remove(peer)
        return found

    def send(self, data: bytes) -> None:
        if not self._peers:
            self.messages_unsent += 1
        for peer in list(self._peers):
            if peer.broken:
                self.messages_unsent += 1
                continue
            if peer.unsent_bytes + len(data) > MOST_UNSENT_BYTES:
                self.messages_unsent += 1
                if not peer.told_unread:
                    peer.told_unread = True
                    self.tell(UNREAD, f"has {peer.unsent_bytes} bytes for {peer.name}, which does not read them: "
                              "frames to it are dropped and counted until it does")
                continue
            peer.unsent.append(data)
            peer.unsent_bytes += len(data)
            if not peer.writes:
                self._flush(peer)

    def counters(self) -> dict[str, int]:
        return {"bytes received": self.bytes_received, "messages received": self.messages_received,
                "bytes sent": self.bytes_sent, "messages sent": self.messages_sent,
                "messages not sent": self.messages_unsent, "connections": self.connections}

    def close(self) -> None:
        for peer in self._peers:
            peer.channel.close()
        self._selector.close()

    # --- for members

    @property
    def peers(self) -> Iterable[StreamPeer]:
        return tuple(self._peers)

    def add(self, name: str, channel: Channel, per_s: int) -> None:
        """Take a peer whose connection has been made; it may send `per_s` bytes a second."""
        peer = StreamPeer(name, channel, Allowance(per_s, self._clock_ns()))
        self._peers.append(peer)
        self._selector.register(channel.fileno(), selectors.EVENT_READ, peer)
        self.connections += 1

    def drop(self, peer: StreamPeer, why: str) -> None:
        """End the connection of a peer."""
        if peer.reads or peer.writes:
            self._selector.unregister(peer.channel.fileno())
        self._peers.remove(peer)
        self.messages_unsent += len(peer.unsent)
        peer.channel.close()
        self.lost(peer, why)

    # --- one peer

    def _read(self, peer: StreamPeer, now_ns: int) -> bytes | None:
        try:
            data = peer.channel.read(self._chunk_bytes)
        except OSError as error:
            self.drop(peer, error.strerror or str(error))
            return None
        if data is None:
            return None
        if not data:
            self.drop(peer, "the other end closed it")
            return None
        self.bytes_received += len(data)
        self.messages_received += 1
        if not peer.allowance.take(now_ns, len(data)):
            peer.allowance.charge(len(data))
            peer.reads = False
            self._watch(peer)
            self.tell_flood(peer.allowance, f"{peer.name} sends more than {peer.allowance.per_s} bytes a second and is "
                            "made to wait; raise most_bytes_per_s if that is what it should send")
        return data

    def _flush(self, peer: StreamPeer) -> None:
        """Send what the peer takes now, and have the rest sent when it takes more."""
        try:
            while peer.unsent:
                taken = peer.channel.write(peer.unsent[0])
                self.bytes_sent += taken
                peer.unsent_bytes -= taken
                if taken < len(peer.unsent[0]):
                    peer.unsent[0] = peer.unsent[0][taken:]
                    break
                peer.unsent.popleft()
                self.messages_sent += 1
        except OSError:                     # what it sent before is read first
            self.messages_unsent += len(peer.unsent)
            peer.unsent.clear()
            peer.broken = True
        if peer.writes != bool(peer.unsent):
            peer.writes = not peer.writes
            self._watch(peer)

    def _watch(self, peer: StreamPeer) -> None:
        """Watch the peer's file for what it waits for; a file that waits for nothing is not watched."""
        events = selectors.EVENT_READ * peer.reads | selectors.EVENT_WRITE * peer.writes
        descriptor = peer.channel.fileno()
        watched = descriptor in self._selector.get_map()
        if watched and events:
            self._selector.modify(descriptor, events, peer)
        elif watched:
            self._selector.unregister(descriptor)
        elif events:
            self._selector.register(descriptor, events, peer)
