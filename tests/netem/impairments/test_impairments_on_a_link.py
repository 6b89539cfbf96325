"""Impairments where they run: on a directed link, with a ledger that counts every copy."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.core.fate import Fate
from netem.core.frame import Frame
from netem.core.random_streams import stream
from netem.impairments.bernoulli_loss import BernoulliLoss
from netem.impairments.corrupt import Corrupt
from netem.impairments.delay import Delay
from netem.impairments.duplicate import Duplicate
from netem.impairments.gilbert_elliott import GilbertElliott
from netem.impairments.rate_limit import RateLimit
from netem.impairments.reorder import Reorder
from netem.impairments.scripted_loss import ScriptedLoss
from netem.impairments.window import Window
from netem.media.links import Links
from netem.records.ledger import Ledger

LINK = ("radio", "a", "b")
MAKERS = {
    "loss": lambda rng: BernoulliLoss(0.3, rng=rng),
    "bursts": lambda rng: GilbertElliott(0.3, 4, rng=rng),
    "script": lambda rng: ScriptedLoss([1, 4]),
    "delay": lambda rng: Delay(500, "uniform", 400, rng=rng),
    "twice": lambda rng: Duplicate(0.5, 100, rng=rng),
    "order": lambda rng: Reorder(700, 0.3, rng=rng),
    "noise": lambda rng: Corrupt(0.01, rng=rng),
    "queue": lambda rng: RateLimit(80_000_000, queue_frames=1),
    "window": lambda rng: Window(Duplicate(1.0, rng=rng), [(0, 20_000)]),
}


def through(pipeline, count=60, *, checksum=False, end_ns=1 << 62):
    """A ledger and what was delivered, as (arrival, data), after `count` frames of 10 bytes, one every microsecond."""
    ledger, delivered = Ledger(), []

    def deliver(receiver, medium, arrival_ns, data):
        if arrival_ns < end_ns:
            delivered.append((arrival_ns, data))

    links = Links(ledger, deliver, {LINK: pipeline})
    for n in range(count):
        ledger.expect(1)
        links.receive(Frame("radio", "a", n, n * 1000, n.to_bytes(10, "big")), "b", n * 1000, checksum=checksum)
    return ledger, delivered


@settings(deadline=None)
@given(st.lists(st.sampled_from(sorted(MAKERS)), max_size=6), st.booleans(), st.sampled_from([30_000, 1 << 62]))
def test_every_copy_ends_in_exactly_one_fate_whatever_is_on_the_link(names, checksum, end_ns):
    pipeline = [(f"impairments[{n}]", MAKERS[name](stream(7, f"{n}"))) for n, name in enumerate(names)]

    ledger, delivered = through(pipeline, checksum=checksum, end_ns=end_ns)

    result = ledger.finish(end_ns=end_ns)       # raises if copies are missing
    arrived = result.by_fate.get(Fate.DELIVERED.value, 0) + result.by_fate.get(Fate.DELIVERED_CORRUPT.value, 0)
    assert result.rows == result.expected >= 60
    assert arrived == len(delivered)
    copies = Counter((row[2], row[4]) for row in ledger.rows)           # (frame number, copy)
    assert set(copies.values()) == {1}
    assert all(set(range(max(c for n, c in copies if n == number) + 1)) == {c for n, c in copies if n == number}
               for number in range(60))


def test_a_loss_names_the_impairment_that_caused_it():
    ledger, delivered = through([("first", ScriptedLoss([3])), ("second", ScriptedLoss([3, 5]))], 7)

    assert [(row[2], row[11], row[12]) for row in ledger.rows if row[11] != "delivered"] == [
        (3, "lost", "first"), (5, "lost", "second")]
    assert len(delivered) == 5


def test_duplicates_made_before_a_queue_take_their_place_in_it():
    twice, slow = Duplicate(1.0, rng=stream(7, "twice")), RateLimit(80_000_000, queue_frames=0)

    ledger, delivered = through([("twice", twice), ("slow", slow)], 5)      # 10 bytes take 1 us, one comes every 1 us

    assert [at_ns for at_ns, _ in delivered] == [1000, 2000, 3000, 4000, 5000]
    assert ledger.closed == {Fate.DELIVERED: 5, Fate.QUEUE_FULL: 5}


@pytest.mark.parametrize(("checksum", "fate"), [(True, Fate.CORRUPTED), (False, Fate.DELIVERED_CORRUPT)])
def test_a_damaged_copy_is_found_by_a_checksum_and_arrives_damaged_without(checksum, fate):
    ledger, delivered = through([("noise", Corrupt(frame_ratio=1.0, rng=stream(7, "noise")))], 5, checksum=checksum)

    assert ledger.closed == {fate: 5}
    assert len(delivered) == (0 if checksum else 5)
    assert all(data != n.to_bytes(10, "big") for n, (_, data) in enumerate(delivered))


def test_another_impairment_before_it_leaves_an_impairments_own_draws_as_they_were():
    alone = through([("loss", BernoulliLoss(0.3, rng=stream(7, "loss")))])[1]
    behind = through([("delay", Delay(500, "normal", 100, rng=stream(7, "delay"))),
                      ("loss", BernoulliLoss(0.3, rng=stream(7, "loss")))])[1]

    assert [data for _, data in alone] == [data for _, data in behind]
