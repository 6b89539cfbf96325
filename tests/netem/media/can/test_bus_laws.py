"""What holds on a bus whatever is handed out: conservation, one frame at a time, bounds of the lookahead, replay."""

from __future__ import annotations

from collections import Counter
from functools import partial
from itertools import pairwise
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from netem.core.agenda import OFFER, Agenda
from netem.emulator.conductor import Conductor
from netem.media.can.bit_errors import BitErrorSettings
from netem.media.can.bus import CanBus
from netem.media.can.encoded_frame import encode_frame
from netem.media.can.frame import CanFrame, pack
from netem.media.can.messages import CanMessage
from netem.media.can.settings import CanSettings
from netem.media.links import Links
from netem.node.node import Node
from netem.records.ledger import Ledger
from netem.transport.hosts import InlineHost
from tests.examples import examples
from tests.netem.media.can.can_bench import BIT, MS, US, CanBench
from tests.netem.media.can.frames import frames

NODES = ["a", "b", "c"]
few = st.sampled_from([CanFrame(0x100, b"x"), CanFrame(0x100, b"y"), CanFrame(0x200), CanFrame(0x100, remote=True)])
anything = st.one_of(few.map(pack), frames.map(pack), st.binary(max_size=20))
offers = st.lists(st.tuples(st.integers(0, 2000).map(lambda at: at * US // 2), st.sampled_from(NODES), anything),
                  max_size=30)
KINDS: dict[str, dict[str, Any]] = {
    "quiet": {}, "can fd": {"data_bit_rate_bps": 2_000_000, "own_frames_to": ("a",)},
    "noisy": {"bit_errors": BitErrorSettings(3e-3), "own_frames_to": ("b",), "queue": "mailbox"},
    "very noisy": {"bit_errors": BitErrorSettings(0.05), "data_bit_rate_bps": 8_000_000, "queue_frames": 3,
                   "error_messages_to": ("a", "c"), "queue": "fifo"},
    "dying": {"bit_errors": BitErrorSettings(0.2), "at_bus_off": "keep", "error_messages_to": ("b",),
              "bit_rate_bps": 333_333, "data_bit_rate_bps": 666_667},
}


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=examples(40), deadline=None)
@given(offers=offers, end=st.integers(1, 4000))
def test_every_copy_has_one_fate_and_frames_never_overlap(kind: str, offers: list[tuple[int, str, bytes]],
                                                          end: int) -> None:
    bench = CanBench(NODES, end_ns=end * US, **KINDS[kind]).run(*(one for one in offers if one[0] < end * US))

    copies = Counter((row["sender"], row["number"], row["receiver"], row["copy"]) for row in bench.rows())
    assert set(copies.values()) <= {1}
    first = [key for key in copies if key[3] == 0]
    own = sum(sender in KINDS[kind].get("own_frames_to", ()) for at_ns, sender, _ in offers if at_ns < end * US)
    assert len(first) == 2 * sum(at_ns < end * US for at_ns, _, _ in offers) + own
    carried = sorted({(row["on_air_ns"], row["end_ns"]) for row in bench.rows() if row["fate"] == "delivered"})
    gap_ns = 3 * 10**9 // KINDS[kind].get("bit_rate_bps", 500_000) - 1
    assert all(start_ns >= end_ns + gap_ns for (_, end_ns), (start_ns, _) in pairwise(carried))
    assert all(row["offered_ns"] <= row["on_air_ns"] < row["delivered_ns"] <= row["end_ns"]
               for row in bench.rows() if row["fate"] == "delivered" and row["copy"] == 0)


def windows(bench: CanBench, offers: list[tuple[int, str, bytes]], slack_ns: list[int]) -> None:
    """Run as the conductor does; the bench checks every arrival against every bound given before."""
    offers = sorted(offers, key=lambda one: one[:2])
    agenda, slack = bench.agenda, iter(slack_ns)
    while offers or agenda.next_ns() < bench.end_ns:
        next_out_ns = offers[0][0] if offers else bench.end_ns
        while agenda.next_ns() < next_out_ns:
            agenda.run_before(agenda.next_ns() + 1)
        if not offers:
            return
        t0_ns = max(agenda.now_ns, min(agenda.next_ns(), next_out_ns) - next(slack, 0))
        horizon_ns = bench.bus.lookahead_ns(t0_ns)
        assert horizon_ns >= t0_ns
        bench.bounds_ns.append(horizon_ns)
        limit_ns = max(horizon_ns, next_out_ns + 1)
        while offers and offers[0][0] < limit_ns:
            bench.offer(*offers.pop(0))
        agenda.run_before(limit_ns)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=examples(40), deadline=None)
@given(offers=offers, slack_ns=st.lists(st.integers(0, 500 * US), max_size=40))
def test_nothing_arrives_before_a_bound_given_earlier(kind: str, offers: list[tuple[int, str, bytes]],
                                                      slack_ns: list[int]) -> None:
    bench = CanBench(NODES, end_ns=20 * MS, **KINDS[kind])

    windows(bench, offers, slack_ns)

    bench.bus.finish(bench.end_ns)
    bench.ledger.finish()


def test_an_idle_bus_promises_the_shortest_frame_and_a_remote_frame_meets_it() -> None:
    shortest = min((CanFrame(can_id, remote=True, dlc=dlc) for can_id in range(0x800) for dlc in (0, 2, 5)),
                   key=lambda frame: encode_frame(pack(frame)).nominal_bits)
    bench = CanBench()

    promised_ns = bench.bus.lookahead_ns(5000)

    bench.run((5000, "a", shortest))
    assert promised_ns == bench.arrivals[0][0] == 5000 + 43 * BIT


def test_a_busy_bus_promises_its_rest_the_intermission_and_the_shortest_frame() -> None:
    bench = CanBench()
    bench.offer(0, "a", CanFrame(0x123, bytes(8)))
    bench.agenda.run_before(1)

    free_ns = bench.bus.busy_until_ns
    assert free_ns > 100 * BIT
    assert bench.bus.lookahead_ns(1000) == free_ns + 43 * BIT
    assert bench.bus.lookahead_ns(free_ns + 7) == free_ns + 7 + 43 * BIT


def test_declared_messages_that_are_all_there_is_make_the_lookahead_longer() -> None:
    bench = CanBench(messages={"one": CanMessage(0x100, 10 * MS, "a", 8), "two": CanMessage(0x200, 10 * MS, "b", 4)},
                     messages_only=True)

    assert bench.bus.lookahead_ns(0) == (34 + 32 + 10 - 1) * BIT


# --- under the conductor

END_NS = 300 * MS


def talkative(name: str) -> Node:
    """Speaks at random instants; answers every third frame it hears 20 us later."""
    node, rng, heard = Node(name, ["can"]), Random(name), []

    def frame() -> bytes:
        return pack(CanFrame(int(rng.random() * 0x800), rng.randbytes(int(rng.random() * 9))))

    def speak():  # type: ignore[no-untyped-def]
        while True:
            yield node.env.timeout(int(rng.random() * 4 * MS) + 1)
            node.ports["can"].send(frame())

    def answer():  # type: ignore[no-untyped-def]
        yield node.env.timeout(20 * US)
        node.ports["can"].send(frame())

    def hear(data: bytes) -> None:
        heard.append(data)
        if len(heard) % 3 == 0:
            node.start(answer())

    node.ports["can"].on_receive = hear
    node.start(speak())
    return node


class NotedBus(CanBus):
    """Notes its offers."""

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.offers: list[tuple[int, str, bytes]] = []

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        self.offers.append((now_ns, sender, data))
        super().offer(sender, data, now_ns)


def bus_and_ledger(agenda: Agenda, deliver: Any, settings: CanSettings) -> tuple[NotedBus, Ledger]:
    ledger = Ledger()
    return NotedBus("can", settings, NODES, agenda, ledger, Links(ledger, deliver, {}), Random), ledger


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "dying"])
def test_windows_decide_the_same_as_one_pass_over_all_offers(kind: str) -> None:
    settings = CanSettings(**{"bit_rate_bps": 250_000, **KINDS[kind]})
    conductor = Conductor(Agenda(), InlineHost({name: partial(talkative, name) for name in NODES}), END_NS)
    bus, ledger = bus_and_ledger(conductor.agenda, conductor.deliver, settings)
    conductor.admit(conductor.host.start(), {"can": bus})
    conductor.run()
    bus.finish(END_NS)
    in_windows = ledger.finish(end_ns=END_NS)

    agenda = Agenda()
    again, ledger = bus_and_ledger(agenda, lambda *delivery: True, settings)
    for at_ns, sender, data in bus.offers:
        agenda.at(at_ns, OFFER, sender, partial(again.offer, sender, data, at_ns))
    agenda.run_before(END_NS)
    again.finish(END_NS)
    in_one_pass = ledger.finish(end_ns=END_NS)
    assert in_windows == in_one_pass
    assert in_windows.rows > 500
    assert in_windows.by_fate["delivered"] > 20
    assert kind not in ("quiet", "noisy", "can fd") or conductor.instant_rounds == 0
