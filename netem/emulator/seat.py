"""The conductor's record of one node: its promise, its horizon, and the deliveries that wait for it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from netem.records.absence import Pause
from netem.wire.instants import NEVER_NS
from netem.wire.messages import Delivery, NodeFault


@dataclass(slots=True, eq=False)
class Seat:
    """The conductor's record of one node. Instants are true time [ns]."""

    name: str
    media: list[str]
    signals: list[tuple[str, str]]
    soft_ns: int = 0
    firm_ns: int = 0
    quiet: frozenset[int] = frozenset() # indices of ports whose deliveries cause no offer
    first_ns: int = NEVER_NS            # arrival of its first undelivered frame
    pending_ns: int = NEVER_NS          # arrival of the first at a port that is not quiet
    earliest_ns: int = 0                # least instant of its next offer: max(firm, min(soft, pending))
    granted_ns: int = 0                 # horizon of its last grant
    sampled_ns: int = 0                 # its last sample
    away_until_ns: int = 0              # what arrives before it does not reach the node, or waits for this instant
    pause: Pause | None = None          # of a node that stands still
    faults: list[NodeFault] = field(default_factory=list)       # for its next grant, all of the present instant
    life: int = 0                       # how often the node was killed
    past: Counter[str] = field(default_factory=Counter)         # its counters from the lives before this one
    inbox: list[Delivery] = field(default_factory=list)
    held: list[Delivery] = field(default_factory=list)          # arrived while the node stands still
    ports: dict[str, int] = field(init=False)           # index of the port to each medium

    def __post_init__(self) -> None:
        self.ports = {medium: index for index, medium in enumerate(self.media)}

    def renew(self) -> None:
        """Recompute `earliest_ns`."""
        self.earliest_ns = max(self.firm_ns, min(self.soft_ns, self.pending_ns))

    def leave(self, now_ns: int, until_ns: int, pause: Pause | None) -> None:
        """Let nothing arrive from now on and before `until_ns`: drop it, or hold it if the node stands still.

        What arrived before now and waits for the next grant stays.
        """
        before = self.take(now_ns)
        due = self.take(until_ns)
        self.away_until_ns, self.pause = until_ns, pause
        if pause is not None:
            for delivery in due:
                self.hold(delivery)
        self.inbox = before + self.inbox
        if before:
            self.first_ns = before[0][0]

    def hold(self, delivery: Delivery) -> None:
        """Keep what arrives while the node stands still."""
        assert self.pause is not None
        arrival_ns, port, _ = delivery
        self.pause.arrives(self.media[port], arrival_ns)
        self.held.append(delivery)

    def come_back(self, now_ns: int) -> list[Delivery]:
        """Return what waited in the receive buffers, to be delivered now."""
        held, depth = sorted(self.held, key=_arrival), 0 if self.pause is None else self.pause.depth
        self.held, self.pause = [], None
        waiting: dict[int, list[Delivery]] = {}
        for _, port, data in held:
            waiting.setdefault(port, []).append((now_ns, port, data))
        return [delivery for deliveries in waiting.values() for delivery in deliveries[:depth]]

    def with_past(self, counters: dict[str, int]) -> dict[str, int]:
        """Return the counters of this life with those of the lives before."""
        if not self.past:
            return counters
        total = Counter(self.past)
        total.update(counters)
        return dict(total)

    def standing(self) -> str:
        """Return the node's last report in words, for an error message."""
        def instant(time_ns: int) -> str:
            return "for ever" if time_ns >= NEVER_NS else f"until {time_ns} ns"
        return (f"had run up to {self.granted_ns} ns, silent {instant(self.soft_ns)} unless it hears something and "
                f"{instant(self.firm_ns)} whatever it hears, {len(self.inbox)} frames waiting for it")

    def take(self, limit_ns: int) -> list[Delivery]:
        """Remove and return the deliveries before `limit_ns`, ordered by arrival, then as the media decided them."""
        if self.first_ns >= limit_ns:
            return []
        inbox = self.inbox
        if len(inbox) > 1:
            inbox.sort(key=_arrival)
        if inbox[-1][0] < limit_ns:
            self.inbox = []
            self.first_ns = self.pending_ns = NEVER_NS
            return inbox
        cut = len(inbox)
        while inbox[cut - 1][0] >= limit_ns:
            cut -= 1
        due, self.inbox = inbox[:cut], inbox[cut:]
        self.first_ns = self.inbox[0][0]
        quiet = self.quiet
        self.pending_ns = next((arrival_ns for arrival_ns, port, _ in self.inbox if port not in quiet), NEVER_NS
                               ) if quiet else self.first_ns
        return due


def _arrival(delivery: Delivery) -> int:
    return delivery[0]
