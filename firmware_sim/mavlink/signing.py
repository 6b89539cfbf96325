"""Message signing of MAVLink 2: accepts frames signed with the key, and refuses repeated old ones.

    signature = link id, timestamp (6 bytes, 10 us), first 6 bytes of SHA-256(key, frame, link id, timestamp)

A timestamp is accepted if it is later than the last one of its stream (system, component, link id); in a new stream, if
it is at most a minute behind this end's timestamp. That is the local clock plus `clock_began_ticks`, at least every
accepted one, and grows with every frame sent.

Invariant: nothing changes unless the hash is right, so a forged timestamp blocks no sender.
Source: mavlink.io, message signing. Not modelled: `SETUP_SIGNING` (the scenario gives the key), timestamps kept over a
restart.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from hashlib import sha256
from typing import Final

from firmware_sim.mavlink.framing import Frame

KEY_BYTES: Final = 32
TICK_NS: Final = 10_000
NEW_STREAM_TICKS: Final = 6_000_000     # a minute


class Verdict(Enum):
    TAKEN = "taken"
    UNSIGNED = "unsigned"
    WRONG = "wrong signature"
    REPLAYED = "replayed"


@dataclass
class Signing:
    key: bytes
    link_id: int = 0
    clock_began_ticks: int = 0          # time of the local clock's 0 since 2015-01-01, in ticks of 10 us
    accept_unsigned: bool = False
    sign_outgoing: bool = True
    _ticks: int = field(default=0, init=False)          # the last timestamp sent or accepted
    _streams: dict[tuple[int, int, int], int] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        if len(self.key) != KEY_BYTES:
            raise ValueError(f"a signing key has {KEY_BYTES} bytes, this one {len(self.key)}")
        if not 0 <= self.link_id <= 255:
            raise ValueError(f"link_id={self.link_id}: expected 0 to 255")

    def beside(self, link_id: int) -> Signing:
        """Return the signing of another link of the same end: a frame that one has accepted is old at the other."""
        other = replace(self, link_id=link_id)
        other._streams = self._streams
        return other

    def judge(self, frame: Frame, now_ns: int) -> Verdict:
        signature = frame.signature
        if not signature:
            return Verdict.TAKEN if self.accept_unsigned else Verdict.UNSIGNED
        if self._hash(frame.unsigned, signature[:7]) != signature[7:]:
            return Verdict.WRONG
        stream = frame.system, frame.component, signature[0]
        ticks = int.from_bytes(signature[1:7], "little")
        last = self._streams.get(stream)
        if ticks <= last if last is not None else ticks + NEW_STREAM_TICKS < self._now(now_ns):
            return Verdict.REPLAYED
        self._streams[stream] = ticks
        self._ticks = max(self._ticks, ticks)
        return Verdict.TAKEN

    def sign(self, frame: bytes, now_ns: int) -> bytes:
        """Return the signature of `frame`, to be sent after it."""
        self._ticks = max(self._now(now_ns), self._ticks + 1)
        stamp = bytes((self.link_id,)) + (self._ticks & (1 << 48) - 1).to_bytes(6, "little")
        return stamp + self._hash(frame, stamp)

    def _now(self, now_ns: int) -> int:
        return max(self.clock_began_ticks + now_ns // TICK_NS, self._ticks)

    def _hash(self, frame: bytes, stamp: bytes) -> bytes:
        return sha256(self.key + frame + stamp).digest()[:6]
