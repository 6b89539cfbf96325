"""Virtual time by conservative windows, on the inline host."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Any

import pytest
import simpy
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from simpy.events import URGENT

from netem.emulator.conductor import MAX_ROUNDS_AT_ONE_INSTANT, Conductor
from netem.media.answers import ShownPose
from netem.node.environment import Alarm
from netem.node.node import Node
from netem.wire.errors import InstantLoop, NodeFailure
from netem.wire.instants import NEVER_NS
from netem.wire.level import Level
from netem.wire.messages import Event, Grant, Hello, Offer, Report, Sample, Shown
from tests.examples import examples

Conduct = Callable[..., Conductor]
Log = list[tuple[int, str, bytes]]


def talker(name: str, instants: Sequence[int], heard: Log, *, firm: bool = False) -> Callable[[], Node]:
    """Sends at the given instants; logs what it hears, with its own time."""

    def build() -> Node:
        node = Node(name, ["wire"])
        node.ports["wire"].on_receive = lambda frame: heard.append((node.now_ns, name, frame))

        def program() -> Generator[Any, Any, None]:
            for instant in instants:
                if firm:
                    node.promise_firm(instant)
                yield node.env.timeout(instant - node.now_ns)
                node.ports["wire"].send(name.encode())

        node.start(program())
        return node

    return build


def test_a_frame_acts_at_its_own_time_at_the_receiver(conduct: Conduct) -> None:
    heard: Log = []

    conduct({"a": talker("a", [100, 200], heard), "b": talker("b", [], heard)}, latency_ns=7, end_ns=1_000)

    assert heard == [(107, "b", b"a"), (207, "b", b"a")]


def test_what_would_arrive_after_the_end_is_never_heard(conduct: Conduct) -> None:
    heard: Log = []

    conduct({"a": talker("a", [100, 200], heard), "b": talker("b", [], heard)}, latency_ns=50, end_ns=250)

    assert heard == [(150, "b", b"a")]


def test_a_firm_promise_saves_grants_and_changes_nothing_else(conduct: Conduct) -> None:
    soft_log: Log = []
    firm_log: Log = []
    slots = {name: [1_000 * (3 * k + i) for k in range(50)] for i, name in enumerate("abc")}

    soft = conduct({name: talker(name, at, soft_log) for name, at in slots.items()}, latency_ns=10, end_ns=200_000)
    firm = conduct({name: talker(name, at, firm_log, firm=True) for name, at in slots.items()}, latency_ns=10,
                   end_ns=200_000)

    assert sorted(soft_log) == sorted(firm_log)
    assert len(soft_log) == 2 * 150
    # One window per slot; then a hears b and c, b hears c, after their own last slots; then the last grant for each.
    assert firm.windows == 150 + 2 + 1
    assert firm.grants == (150 + 2) + 3 + 3             # only the slot's owner is contacted, after the first window
    assert soft.grants > 2 * firm.grants


def listener(heard: Log, *, listen_only: bool, says: int = 900) -> Callable[[], Node]:
    """Ticks every 10 ns and speaks once, at `says`; promises to be silent until then unless it hears something."""

    def build() -> Node:
        node = Node("ear", ["wire"])
        node.ports["wire"].listen_only = listen_only
        node.ports["wire"].on_receive = lambda frame: heard.append((node.now_ns, "ear", frame))

        def program() -> Generator[Any, Any, None]:
            while node.now_ns < says:
                node.promise_soft(says)
                yield node.env.timeout(10)
            node.ports["wire"].send(b"ear")

        node.start(program())
        return node

    return build


def test_a_port_that_does_not_answer_and_events_that_hand_out_nothing_cost_no_grants(conduct: Conduct) -> None:
    heard: Log = []
    answering: Log = []
    at = [100 * k for k in range(1, 9)]

    quiet, loud = (conduct({"ear": listener(log, listen_only=deaf), "a": talker("a", at, [])}, latency_ns=5,
                           end_ns=1_000) for log, deaf in ((heard, True), (answering, False)))

    assert heard == answering == [(instant + 5, "ear", b"a") for instant in at]
    assert quiet.grants == 2 + 8 + 1 + 1 + 2            # the first instant, a's frames, ear speaks, a hears it, the end
    assert loud.grants > quiet.grants + 8


def test_a_program_that_speaks_before_its_soft_promise_without_having_heard_anything_is_named(conduct: Conduct) -> None:
    def build() -> Node:
        node = Node("ear", ["wire"])

        def program() -> Generator[Any, Any, None]:
            node.promise_soft(500)
            yield node.env.timeout(100)
            node.ports["wire"].send(b"early")

        node.start(program())
        return node

    with pytest.raises(NodeFailure, match=r"node ear: .*a frame at 100 ns, but silence was promised until 500 ns"):
        conduct({"ear": build, "a": talker("a", [300], [])}, latency_ns=5, end_ns=1_000)


def test_frames_of_one_instant_are_heard_in_the_order_of_their_senders_names(conduct: Conduct) -> None:
    heard: Log = []
    build = {name: talker(name, [100], []) for name in ("c", "a", "b")}

    conduct({**build, "z": talker("z", [], heard)}, latency_ns=5, end_ns=1_000)

    assert [data for _, _, data in heard] == [b"a", b"b", b"c"]


def test_without_latency_an_answer_comes_at_the_same_instant(conduct: Conduct) -> None:
    answers: Log = []

    def answerer() -> Node:
        node = Node("b", ["wire"])
        node.ports["wire"].on_receive = lambda _: node.ports["wire"].send(b"answer")
        return node

    conductor = conduct({"a": talker("a", [100], answers), "b": answerer}, latency_ns=0, end_ns=1_000)

    assert answers == [(100, "a", b"answer")]
    assert conductor.instant_rounds >= 2


def test_endless_answers_at_one_instant_are_named(conduct: Conduct) -> None:
    def answerer(name: str) -> Callable[[], Node]:
        def build() -> Node:
            node = Node(name, ["wire"])
            node.ports["wire"].on_receive = node.ports["wire"].send
            return node
        return build

    with pytest.raises(InstantLoop) as caught:
        conduct({"a": talker("a", [100], []), "echo1": answerer("echo1"), "echo2": answerer("echo2")}, latency_ns=0,
                end_ns=1_000)

    assert caught.value.time_ns == 100
    assert set(caught.value.nodes) == {"echo1", "echo2"}
    assert str(MAX_ROUNDS_AT_ONE_INSTANT) in str(caught.value)


def test_a_program_that_breaks_its_promise_is_named(conduct: Conduct) -> None:
    def liar() -> Node:
        node = Node("liar", ["wire"])

        def program() -> Generator[Any, Any, None]:
            node.promise_firm(500)
            yield node.env.timeout(600)
            node.promise_firm(900)
            node.ports["wire"].send(b"too early")

        node.start(program())
        return node

    with pytest.raises(NodeFailure, match=r"node liar: its program failed at 600 ns: .*promised until 900 ns"):
        conduct({"liar": liar, "b": talker("b", [], [])}, latency_ns=5, end_ns=1_000)


class ForeignHost:
    """Stands for a host whose nodes are somebody else's code: answers every grant with the same words."""

    def __init__(self, *, offers: Sequence[Offer] = (), samples: Sequence[Sample] = (),
                 events: Sequence[Event] = (), shown: Sequence[Shown] = ()) -> None:
        self._words = list(offers), list(samples), list(events)
        self._shown = list(shown)

    def start(self) -> dict[str, Hello]:
        return {"foreign": Hello("foreign", 100, 100, ["wire"], [("x", "m")])}

    def exchange(self, grants: Sequence[tuple[str, Grant]]) -> list[tuple[str, Report]]:
        return [(name, Report(grant.window, NEVER_NS, 0, *self._words, {}, "", None, None, self._shown))
                for name, grant in grants]

    def stop(self) -> None:
        pass


@pytest.mark.parametrize(("offer_ns", "port"), [(99, 0), (105, 0), (100, 1), (100, -1)])
def test_an_offer_outside_the_promise_or_the_grant_is_refused_with_its_numbers(conduct: Conduct, offer_ns: int,
                                                                              port: int) -> None:
    told = rf"node foreign: broke its promise in window 1: .*port {port} at {offer_ns} ns.* 100 <= time < 105 ns"
    with pytest.raises(NodeFailure, match=told):
        conduct({}, latency_ns=5, end_ns=1_000, host=ForeignHost(offers=[(offer_ns, port, b"x")]))


@pytest.mark.parametrize("shown", [
    (95, 0, [1.0, 2.0]), (105, 0, [1.0, 2.0]), (101, 0, [1.0, 2.0]), (100, 1, [1.0, 2.0]), (100, -1, [1.0, 2.0]),
    (100, 0, [1.0]), (100, 0, [1.0, 2.0, 3.0]), (100, 0, [1.0, float("nan")]),
])
def test_a_pose_that_no_medium_asked_for_is_refused_with_its_numbers(conduct: Conduct, shown: Shown) -> None:
    told = rf"node foreign: shows nonsense in window 1: {len(shown[2])} numbers on port {shown[1]} at {shown[0]} ns, .*"
    with pytest.raises(NodeFailure, match=told):
        conduct({}, latency_ns=5, end_ns=1_000, host=ForeignHost(shown=[shown]),
                poses={"foreign": ShownPose(5, ("x", "y"))})
    with pytest.raises(NodeFailure, match=told):
        conduct({}, latency_ns=5, end_ns=1_000, host=ForeignHost(shown=[shown]))


@pytest.mark.parametrize(("host", "told"), [
    (ForeignHost(samples=[(50, [1.0, 2.0])]), "2 values of its 1 signals at 50 ns, expected 1"),
    (ForeignHost(samples=[(-1, [1.0])]), r"1 values of its 1 signals at -1 ns, .* 0 <= time <= 105 ns"),
    (ForeignHost(samples=[(2 ** 64 - 1, [1.0])]), r"signals at 18446744073709551615 ns, .* 0 <= time <= 105 ns"),
    (ForeignHost(events=[(106, "turn", "", Level.INFO)]), r"its event 'turn' at 106 ns, expected 0 <= time <= 105 ns"),
])
def test_samples_and_events_that_cannot_be_are_refused_before_they_reach_a_record(conduct: Conduct, host: ForeignHost,
                                                                                  told: str) -> None:
    with pytest.raises(NodeFailure, match=f"node foreign: reports nonsense in window 1: .*{told}"):
        conduct({}, latency_ns=5, end_ns=1_000, host=host)



def chatter(name: str, seed: int, promise: str, heard: Log) -> tuple[Callable[..., Any], Callable[..., None],
                                                                     Callable[..., Any]]:
    """A program whose times and answers depend on what it hears, written against `env`, `send` and `heard` only.

    `promise`: "soft" and "calm" answer now and then, "firm" and "quiet" never; "calm" promises to be silent until it
    hears something, although its `ticks` are events of its own.
    """
    state = {"x": seed}

    def draw(bound: int) -> int:
        state["x"] = (state["x"] * 1103515245 + 12345) % 2**31
        return int(state["x"] >> 7) % bound

    def program(env: Any, send: Any, promised: Any) -> Generator[Any, Any, None]:
        while True:
            pause = 1 + draw(40)
            promised(env.now + pause)
            yield env.timeout(pause)
            send(f"{name}@{env.now}".encode())

    def ticks(env: Any) -> Generator[Any, Any, None]:
        while promise == "calm":
            yield env.timeout(7)
            heard.append((int(env.now), name, b"tick %d" % state["x"]))

    def on_frame(env: Any, send: Any, data: bytes) -> None:
        heard.append((int(env.now), name, data))
        state["x"] = (state["x"] + sum(data)) % 2**31
        if promise in ("soft", "calm") and draw(4) == 0:
            send(b"re:" + data[:8])

    return program, on_frame, ticks


@settings(max_examples=examples(40), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seeds=st.lists(st.integers(1, 10**6), min_size=2, max_size=5),
       promises=st.lists(st.sampled_from(["soft", "firm", "quiet", "calm"]), min_size=5, max_size=5),
       latency_ns=st.integers(1, 60))
def test_windows_give_what_one_global_event_list_gives(conduct: Conduct, seeds: list[int], promises: list[str],
                                                       latency_ns: int) -> None:
    """The oracle is one SimPy environment for all nodes: no windows, no promises, no grants."""
    end_ns = 600
    names = [f"n{i}" for i in range(len(seeds))]
    windowed: Log = []
    globally: Log = []

    def build(i: int) -> Callable[[], Node]:
        def make() -> Node:
            node = Node(names[i], ["wire"])
            program, on_frame, ticks = chatter(names[i], seeds[i], promises[i], windowed)
            send = node.ports["wire"].send
            node.ports["wire"].on_receive = lambda data: on_frame(node.env, send, data)
            node.ports["wire"].listen_only = promises[i] == "quiet"
            promised = {"firm": node.promise_firm, "calm": node.promise_soft}.get(promises[i], lambda _: 0)
            node.start(program(node.env, send, promised))
            node.start(ticks(node.env))
            return node
        return make

    conduct({name: build(i) for i, name in enumerate(names)}, latency_ns=latency_ns, end_ns=end_ns)
    _run_globally(names, seeds, promises, latency_ns, end_ns, globally)

    assert sorted(windowed) == sorted(globally)
    assert len(windowed) > 0


def _run_globally(names: list[str], seeds: list[int], promises: list[str], latency_ns: int, end_ns: int,
                  log: Log) -> None:
    """Frames of one instant reach a node in the order (sender, sequence), and before its own timers."""
    env = simpy.Environment(initial_time=0)
    programs = {}
    due: dict[str, dict[int, list[tuple[str, int, bytes]]]] = {name: {} for name in names}
    sequence = dict.fromkeys(names, 0)

    def sender(name: str) -> Callable[[bytes], None]:
        def send(data: bytes) -> None:
            sequence[name] += 1
            for other in names:
                if other != name:
                    arrival = int(env.now) + latency_ns
                    batch = due[other].setdefault(arrival, [])
                    batch.append((name, sequence[name], data))
                    if len(batch) == 1:
                        env.schedule(Alarm(lambda _, other=other, arrival=arrival: arrive(other, arrival)),
                                     URGENT, latency_ns)
        return send

    def arrive(name: str, arrival: int) -> None:
        for _, _, data in sorted(due[name].pop(arrival)):
            programs[name][1](env, sender(name), data)

    for i, name in enumerate(names):
        programs[name] = chatter(name, seeds[i], promises[i], log)
        env.process(programs[name][0](env, sender(name), lambda _: None))
        env.process(programs[name][2](env))
    env.run(until=end_ns)
