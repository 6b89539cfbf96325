"""One impairment for several links: a frame passes once, its copies end alike, a further link changes nothing."""

from __future__ import annotations

from itertools import pairwise

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
from netem.impairments.gilbert_elliott_by_time import GilbertElliottByTime
from netem.impairments.rate_limit import RateLimit
from netem.impairments.scripted_loss import ScriptedLoss
from netem.impairments.shared import Shared
from netem.impairments.window import Window
from netem.media.links import Links
from netem.records.ledger import Ledger
from tests.examples import examples

MS = 1_000_000
MAKERS = {
    "loss": lambda: BernoulliLoss(0.3, rng=stream(7, "loss")),
    "bursts": lambda: GilbertElliott(0.3, 4, rng=stream(7, "bursts")),
    "fades": lambda: GilbertElliottByTime(40 * MS, 20 * MS, 0.9, rng=stream(7, "fades")),
    "delay": lambda: Delay(500, "uniform", 400, rng=stream(7, "delay")),
    "twice": lambda: Duplicate(0.5, 100, rng=stream(7, "twice")),
    "noise": lambda: Corrupt(0.01, rng=stream(7, "noise")),
    "queue": lambda: RateLimit(8_000, queue_frames=3),
    "script": lambda: ScriptedLoss([0, 3], every=5),
    "window": lambda: Window(BernoulliLoss(0.5, rng=stream(7, "window")), [(20 * MS, 60 * MS)]),
}


def through(impairment, frames, receivers):
    """What each link delivers of (time_ns, sender) frames of 10 bytes, and the ledger; None: a copy not received."""
    ledger, heard = Ledger(), {}
    links_of = {("radio", sender, receiver): [("shared", impairment)] for sender in "ab" for receiver in receivers}
    links = Links(ledger, lambda receiver, medium, at_ns, data: heard.setdefault(receiver, []).append((at_ns, data)),
                  links_of)
    for n, (at_ns, sender) in enumerate(frames):
        frame = Frame("radio", sender, n, at_ns, n.to_bytes(10, "big"))
        for receiver in receivers:
            ledger.expect(1)
            links.receive(frame, receiver, at_ns, checksum=False)
    return heard, ledger


EVERY_MS = [(k * MS, "ab"[k % 2]) for k in range(200)]


@pytest.mark.parametrize("name", MAKERS)
def test_all_copies_of_a_frame_end_alike_and_pass_once(name):
    heard, ledger = through(Shared(MAKERS[name]()), EVERY_MS, "xyz")
    single = MAKERS[name]()                     # a script goes by numbers, which without sharing are those of a link
    alone, _ = through(Shared(single) if name == "script" else single, EVERY_MS, "x")

    assert heard["x"] == heard["y"] == heard["z"] == alone["x"]
    assert ledger.finish(end_ns=1 << 62).rows == ledger.expected


@pytest.mark.parametrize("name", MAKERS)
def test_a_further_receiver_changes_nothing(name):
    few, many = (through(Shared(MAKERS[name]()), EVERY_MS, receivers)[0] for receivers in ("xy", "wxyz"))

    assert {receiver: many[receiver] for receiver in "xy"} == few


def test_frames_are_numbered_in_the_order_in_which_they_pass():
    heard, _ = through(Shared(ScriptedLoss([0, 3], every=5)), EVERY_MS, "xy")

    passed = [int.from_bytes(data, "big") for _, data in heard["y"]]
    assert passed == [n for n in range(200) if n % 5 not in (0, 3)]


def test_a_fade_is_the_same_whoever_else_speaks():
    frames = {"a": [at for at in EVERY_MS if at[1] == "a"], "both": EVERY_MS}

    heard = {name: through(Shared(GilbertElliottByTime(20 * MS, 20 * MS, rng=stream(7, "fades"))), offered, "x")[0]["x"]
             for name, offered in frames.items()}

    from_a = {at_ns for at_ns, sender in EVERY_MS if sender == "a"}
    assert [at_ns for at_ns, _ in heard["a"]] == [at_ns for at_ns, _ in heard["both"] if at_ns in from_a]
    assert 20 < len(heard["a"]) < 80


def test_a_broadcast_takes_one_place_in_a_queue_for_all_senders():
    """By Lindley's recursion: 10 bytes take 2.5 ms, one comes every ms; three wait besides the one that is sent."""
    heard, ledger = through(Shared(RateLimit(32_000, queue_frames=3)), EVERY_MS, "xyz")

    arrivals = [at_ns for at_ns, _ in heard["x"]]
    assert {b - a for a, b in pairwise(arrivals)} == {2_500_000}
    assert heard["x"] == heard["y"] == heard["z"]
    assert ledger.closed[Fate.DELIVERED] == 3 * len(arrivals)
    assert len(arrivals) == 200 - ledger.closed[Fate.QUEUE_FULL] // 3


@settings(max_examples=examples(60), deadline=None)
@given(st.lists(st.tuples(st.integers(0, 3 * MS), st.sampled_from("ab")), max_size=40), st.sampled_from(sorted(MAKERS)))
def test_every_copy_ends_once(gaps, name):
    now_ns, frames = 0, []
    for gap_ns, sender in gaps:
        now_ns += gap_ns
        frames.append((now_ns, sender))

    _, ledger = through(Shared(MAKERS[name]()), frames, "xy")

    result = ledger.finish(end_ns=1 << 62)
    assert result.rows == result.expected >= 2 * len(frames)
