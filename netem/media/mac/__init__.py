"""Media access: when a radio puts on the air what its node handed out.

A member of this kind has one verb, `submit`; the medium tells it what the radio of each node then goes through.

Invariants:
- every submitted frame goes to `Channel.start` or `Channel.drop`, exactly once, or is among `waiting()`;
- a frame that has to wait starts in an event of priority OFFER: after all that ends or is sensed at that instant;
- a node's random numbers come from its own stream.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from random import Random
from typing import Literal, Protocol

from netem.core.agenda import Agenda
from netem.core.fate import Fate
from netem.core.frame import Frame

StreamFor = Callable[[str], Random]     # a node's own stream


class Channel(Protocol):
    """What a MAC may ask of the medium."""

    agenda: Agenda

    def transmitting(self, node: str) -> bool: ...

    def carriers(self, node: str) -> int:
        """How many frames are on the air that `node` is in range of or sends itself; kept only if the MAC senses."""

    def start(self, frame: Frame, now_ns: int) -> None: ...

    def drop(self, frame: Frame, fate: Fate, cause: str = "") -> None: ...


class Mac(Protocol):
    senses: bool            # wants `heard` and `cleared`
    min_wait_ns: int        # from handing out to the start on the air, at the least

    def submit(self, frame: Frame, now_ns: int) -> None: ...

    def sent(self, node: str, now_ns: int) -> None:
        """`node`'s frame has left the air."""

    def heard(self, node: str, now_ns: int) -> None:
        """The air around `node` is no longer silent."""

    def cleared(self, node: str, now_ns: int) -> None:
        """The air around `node` is silent again."""

    def waiting(self) -> Iterable[Frame]:
        """Frames handed out and not yet on the air; as a truth value: is there any?"""


@dataclass(frozen=True)
class CarrierSense:
    """Listen before talk. `unslotted` is that of IEEE 802.15.4, `dcf` that of IEEE 802.11."""

    scheme: Literal["unslotted", "dcf"]
    slot_ns: int            # unit of the back-off
    wait_ns: int            # silence before the back-off (DIFS)
    cca_ns: int             # how long the channel is listened to; `dcf` listens all the time
    turnaround_ns: int      # from the decision to the first bit: two nodes that decide within it collide
    min_exponent: int       # back-off drawn from 0 .. 2**exponent - 1 slots
    max_exponent: int       # `unslotted` adds 1 after every busy channel, up to this
    max_attempts: int       # `unslotted` gives a frame up when the channel was busy this often

    def __post_init__(self) -> None:
        for name in ("slot_ns", "wait_ns", "cca_ns", "turnaround_ns"):
            if getattr(self, name) < 0:
                raise ValueError(f"csma: {name}={getattr(self, name)}: expected {name} >= 0")
        if not 0 <= self.min_exponent <= self.max_exponent <= 16:
            raise ValueError(f"csma: min_exponent={self.min_exponent}, max_exponent={self.max_exponent}: "
                             f"expected 0 <= min <= max <= 16")
        if self.scheme == "unslotted" and self.max_attempts < 1:
            raise ValueError(f"csma: max_attempts={self.max_attempts}: expected at least 1")
        if self.scheme == "dcf" and self.slot_ns < 1:
            raise ValueError(f"csma: slot_ns={self.slot_ns}: expected at least 1 for scheme 'dcf'")
        if self.scheme == "dcf" and self.turnaround_ns > self.wait_ns:
            raise ValueError(f"csma: turnaround_ns={self.turnaround_ns}: expected at most wait_ns ({self.wait_ns})")


def draw_slots(rng: Random, exponent: int) -> int:
    return rng.getrandbits(exponent) if exponent else 0
