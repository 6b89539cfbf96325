"""Watches the questions about time that pass a gateway, and asks its own: the device's clock, and round trips.

    inside asks:   robot --media--> gateway --> device --> gateway --media--> robot      the device's clock is estimated
    outside asks:  device --> gateway --media--> robot --media--> gateway --> device
    gateway asks:  gateway --> device --> gateway                                        the device's clock is estimated

All is measured where the bytes leave and enter the emulator, so that an estimate has no part of an emulated delay. Each
answered question is a sample of the gateway's signals SIGNALS.

Invariants:
- at most MOST_OPEN questions wait for their answers, the oldest is forgotten;
- answers to the gateway's own questions do not reach its medium.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from math import nan
from typing import Final, NamedTuple, Protocol

from netem.gateways.clock_estimate import ClockEstimate

MOST_OPEN: Final = 100
ASK_EVERY_NS: Final = 250_000_000           # virtual time between questions of the gateway
NS_PER_S: Final = 1_000_000_000


class Asker(IntEnum):
    """Who asked; the value is that of the signal `asked_by`."""

    GATEWAY = 0
    INSIDE = 1
    OUTSIDE = 2


# The clock is the device's minus the run's. `due`, `sent` and `came` are virtual time: when the message that left was
# due, when it left, when the one that entered came; `entered` is the number of its frame on the medium, -1 for none.
SIGNALS: Final = (("device_offset", "s"), ("device_offset_bound", "s"), ("device_drift", "ppm"),
                  ("device_drift_bound", "ppm"), ("asked_by", "1"), ("due", "s"), ("sent", "s"), ("came", "s"),
                  ("entered", "1"))


class TimeMessage(NamedTuple):
    """A question with its token, or the answer with the same token and the answering clock's time."""

    token: int
    stamp_ns: int | None        # None: a question


class TimeProtocol(Protocol):
    """A protocol in which one end asks the other for its time, as MAVLink with TIMESYNC."""

    def read(self, data: bytes) -> Iterable[TimeMessage]:
        """Return the questions and answers in a message; never raises for bytes."""

    def question(self, token: int) -> bytes:
        """Return a message that asks for the time."""


class _Question(NamedTuple):
    asker: Asker
    due_ns: int
    at_ns: int                  # when it left or came, in virtual time
    entered: int                # the number of its frame if it came, else -1
    clock_ns: int               # and by the run's clock


@dataclass
class TimeWatch:
    """`record(time_ns, values)` takes the samples, `was_set()` is called when the device's clock was set.

    `asks` lets the gateway ask as well.
    """

    protocol: TimeProtocol
    record: Callable[[int, Sequence[float]], None]
    asks: bool = False
    was_set: Callable[[], None] = lambda: None
    clock: ClockEstimate = field(default_factory=ClockEstimate)
    _open: dict[int, _Question] = field(default_factory=dict)
    _entered: int = 0           # messages that went on to the medium, each a frame of the gateway
    _token: int = 0x6D61_7263_6F00_0000     # of the next own question; large, so that no clock of a robot shows it

    def ask(self, now_ns: int, clock_ns: int) -> bytes:
        """Return a question that leaves now."""
        self._token += 1
        self._remember(self._token, _Question(Asker.GATEWAY, now_ns, now_ns, -1, clock_ns))
        return self.protocol.question(self._token)

    def leaves(self, data: bytes, due_ns: int, now_ns: int, clock_ns: int) -> None:
        """Note a message that leaves at the virtual time `now_ns`, though due at `due_ns`."""
        for token, stamp_ns in self.protocol.read(data):
            if stamp_ns is None:
                self._remember(token, _Question(Asker.INSIDE, due_ns, now_ns, -1, clock_ns))
            elif (asked := self._open.get(token)) is not None and asked.asker is Asker.OUTSIDE:
                del self._open[token]
                self._record(now_ns, (nan, nan, nan, nan), Asker.OUTSIDE, asked.entered, due_ns, now_ns,
                             asked.at_ns)

    def enters(self, data: bytes, now_ns: int, clock_ns: int) -> bool:
        """Note a message that comes in; return False if it is for the gateway alone."""
        own = other = False
        for token, stamp_ns in self.protocol.read(data):
            asked = self._open.get(token)
            if stamp_ns is None:
                other = True
                self._remember(token, _Question(Asker.OUTSIDE, 0, now_ns, self._entered, clock_ns))
            elif asked is not None and asked.asker is not Asker.OUTSIDE:
                del self._open[token]
                own, other = own or asked.asker is Asker.GATEWAY, other or asked.asker is Asker.INSIDE
                steps = self.clock.steps
                found = self.clock.exchanged(asked.clock_ns, stamp_ns, clock_ns)
                if self.clock.steps > steps:
                    self.was_set()
                self._record(now_ns, (found.offset_ns / NS_PER_S, found.offset_bound_ns / NS_PER_S, found.drift_ppm,
                                      found.drift_bound_ppm), asked.asker,
                             -1 if asked.asker is Asker.GATEWAY else self._entered, asked.due_ns, asked.at_ns, now_ns)
        if own and not other:
            return False
        self._entered += 1
        return True

    def _remember(self, token: int, question: _Question) -> None:
        self._open.pop(token, None)
        if len(self._open) >= MOST_OPEN:
            del self._open[next(iter(self._open))]
        self._open[token] = question

    def _record(self, now_ns: int, clock: Sequence[float], asker: Asker, entered: int, *times_ns: int) -> None:
        self.record(now_ns, (*clock, float(asker), *(time_ns / NS_PER_S for time_ns in times_ns), float(entered)))
