"""Declarations of other nodes: each holds for the lease from the last time that it was heard."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from heapq import heappop, heappush

from firmware_sim.zenoh_programs.hybrid_clock import HybridClock
from firmware_sim.zenoh_programs.neighbours import Neighbours
from firmware_sim.zenoh_programs.values import stamp_of, timestamp_of
from netem.wire.zenoh_messages import Declare, Entity, Undeclare


class Bench:
    def __init__(self) -> None:
        self.now, self.told, self._waiting = 0, [], []          # type: ignore[var-annotated]
        self.known = Neighbours(10, self.at, lambda: self.now, lambda one: self.told.append((self.now, "+", one.text)),
                                lambda one: self.told.append((self.now, "-", one.text)))

    def at(self, delay: int, action: Callable[[], None]) -> None:
        heappush(self._waiting, (self.now + delay, len(self._waiting), action))

    def run_to(self, time: int) -> None:
        while self._waiting and self._waiting[0][0] <= time:
            self.now, _, action = heappop(self._waiting)
            action()
        self.now = time


def test_it_is_forgotten_a_lease_after_it_was_heard_last_and_known_again_when_heard() -> None:
    bench = Bench()
    for time in (0, 4, 8, 30):
        bench.run_to(time)
        bench.known.declare("radio", 1, Declare(Entity.TOKEN, 1, "a"))
    bench.run_to(60)

    assert bench.told == [(0, "+", "a"), (18, "-", "a"), (30, "+", "a"), (40, "-", "a")]


def test_one_that_is_heard_on_one_of_two_media_is_known() -> None:
    bench = Bench()
    bench.known.declare("radio", 1, Declare(Entity.TOKEN, 1, "a"))
    bench.run_to(6)
    bench.known.declare("lan", 1, Declare(Entity.TOKEN, 1, "a"))
    bench.run_to(12)

    assert [list(known.until_ns) for known in bench.known.those(Entity.TOKEN)] == [["lan"]]


def test_another_key_under_the_same_number_replaces_it_and_an_undeclaration_ends_it() -> None:
    bench = Bench()
    bench.known.declare("radio", 1, Declare(Entity.QUERYABLE, 1, "a"))
    bench.known.declare("radio", 1, Declare(Entity.QUERYABLE, 1, "b"))
    bench.known.declare("radio", 2, Declare(Entity.QUERYABLE, 1, "a"))
    bench.known.undeclare(1, Undeclare(Entity.QUERYABLE, 1))
    bench.known.undeclare(1, Undeclare(Entity.QUERYABLE, 1))

    assert [what for _, *what in bench.told] == [["+", "a"], ["-", "a"], ["+", "b"], ["+", "a"], ["-", "b"]]
    assert bench.known.addresses() == [2]


def test_timestamps_grow_and_come_back_from_the_library_unchanged() -> None:
    clock = HybridClock(iter([5, 5, 3, 10**18 + 999_999_999, 7]).__next__, b"id")

    stamps = [clock.stamp() for _ in range(5)]

    assert [stamp_of(timestamp_of(stamp)) for stamp in stamps] == stamps
    assert all(one < other for one, other in itertools.pairwise(stamps))
