"""Media access: decides when a radio transmits the frames that its node offers.

A member of this kind has one verb, `submit`; by further calls the medium reports transmissions and carriers.

Invariants:
- every submitted frame goes to `Channel.start` or `Channel.drop`, exactly once, or is among `waiting()`;
- a frame that has to wait starts in an event of priority OFFER, after all ends and sensing events of that instant;
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
    """The methods of the medium that a MAC may call."""

    agenda: Agenda

    def transmitting(self, node: str) -> bool: ...

    def carriers(self, node: str) -> int:
        """Number of frames on the air that `node` is in range of or sends itself; counted only if `Mac.senses`."""

    def start(self, frame: Frame, now_ns: int) -> None: ...

    def drop(self, frame: Frame, fate: Fate, cause: str = "") -> None: ...


class Mac(Protocol):
    senses: bool            # whether the medium has to call `heard` and `cleared`
    min_wait_ns: int        # shortest time from an offer to the start of its transmission

    def submit(self, frame: Frame, now_ns: int) -> None: ...

    def sent(self, node: str, now_ns: int) -> None:
        """The transmission of `node` has ended."""

    def heard(self, node: str, now_ns: int) -> None:
        """The channel at `node` has become busy."""

    def cleared(self, node: str, now_ns: int) -> None:
        """The channel at `node` has become idle."""

    def waiting(self) -> Iterable[Frame]:
        """Submitted frames that are not on the air yet; false if there are none."""


@dataclass(frozen=True)
class CarrierSense:
    """Parameters of listen before talk, as in IEEE 802.15.4 (`unslotted`) or IEEE 802.11 (`dcf`)."""

    scheme: Literal["unslotted", "dcf"]
    slot_ns: int            # unit of the back-off
    wait_ns: int            # idle time before the back-off (DIFS)
    cca_ns: int             # duration of a clear channel assessment; `dcf` listens all the time
    turnaround_ns: int      # from the decision to the first bit: two nodes that decide within it collide
    min_exponent: int       # the back-off is drawn from 0 .. 2**exponent - 1 slots
    max_exponent: int       # limit of the exponent, to which `unslotted` adds 1 after every busy channel
    max_attempts: int       # busy assessments after which `unslotted` drops a frame

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
