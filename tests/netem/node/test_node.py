"""What a node refuses from its own program: said with the name and the remedy, on either host alike."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from functools import partial
from typing import Any

import pytest

from netem.emulator.conductor import Conductor
from netem.media.answers import ShownPose
from netem.node.node import Node
from netem.wire.errors import WHOLE_NANOSECONDS, NodeFailure, with_remedy
from netem.wire.messages import Grant

Conduct = Callable[..., Conductor]


def node_that(act: Callable[[Node], Any], wait: Any = 100) -> Callable[[], Node]:
    def build() -> Node:
        node = Node("a", ["wire"], 1_000)

        def program() -> Generator[Any, Any, None]:
            yield node.env.timeout(wait)
            act(node)

        node.start(program())
        return node

    return build


@pytest.mark.parametrize(("act", "wait", "message"), [
    (lambda node: node.ports["wire"].send("hello"), 100, "wire: 'hello' is str: a frame is bytes"),
    (lambda node: node.ports["wire"].send(b"x"), 1e2, "100.0 ns: times are int"),
    (lambda node: node.env.timeout(1e6), 100, "its next event is at 1000100.0 ns: times are int"),
    (lambda node: node.signals([("p", "m"), ("q", "m")], lambda: [1.0]), 100,
     "1 values for the signals p, q at 1000 ns"),
    (lambda node: [node.signals([("p", "m")], float), node.signals([("p", "m")], float)], 100,
     "signal 'p' is there already"),
    (lambda node: sys.exit(3), 100, "SystemExit: 3"),
])
def test_nonsense_of_a_program_names_the_node_and_the_rule(conduct: Conduct, act: Any, wait: Any, message: str) -> None:
    with pytest.raises(NodeFailure) as caught:
        conduct({"a": node_that(act, wait)}, latency_ns=10, end_ns=10_000)

    assert caught.value.node == "a"
    assert message in str(caught.value)


def test_a_program_that_never_lets_time_pass_is_named(conduct: Conduct) -> None:
    def build() -> Node:
        node = Node("a", ["wire"])

        def program() -> Generator[Any, Any, None]:
            while True:
                yield node.env.timeout(0)

        node.start(program())
        return node

    with pytest.raises(NodeFailure, match="100000 events at 0 ns: the program waits for no time to pass"):
        conduct({"a": build}, latency_ns=10, end_ns=10_000)


def test_a_signal_that_is_no_number_is_named(conduct: Conduct) -> None:
    def build() -> Node:
        node = node_that(lambda node: None)()
        node.signals([("speed", "m/s")], lambda: (None,))
        return node

    with pytest.raises(NodeFailure, match=r"the signals speed at 0 ns: \(None,\): expected numbers"):
        conduct({"a": build}, latency_ns=10, end_ns=10_000)


@pytest.mark.parametrize(("error", "has_remedy"), [
    ("int object expected; got float", True), ("TypeError: int object expected; got numpy.int64", True),
    ("int object expected; got str", False), ("no such sensor", False)])
def test_a_time_that_a_compiled_function_refuses_comes_with_the_rule(error: str, has_remedy: bool) -> None:
    assert with_remedy(error) == (f"{error}: {WHOLE_NANOSECONDS}" if has_remedy else error)


def test_buffers_are_frames_and_numpy_numbers_are_samples(conduct: Conduct) -> None:
    import numpy as np

    heard: list[Any] = []
    samples: list[Any] = []

    def receiver() -> Node:
        node = Node("b", ["wire"])
        node.ports["wire"].on_receive = heard.append
        return node

    def sender() -> Node:
        def send(node: Node) -> None:
            node.ports["wire"].send(bytearray(b"x"))
            node.ports["wire"].send(memoryview(b"y"))

        node = node_that(send)()
        node.signals([("p", "m")], lambda: (np.float64(2.5),))
        return node

    conduct({"a": sender, "b": receiver}, latency_ns=10, end_ns=2_000, samples=samples)

    assert heard == [b"x", b"y"]
    assert samples == [("a", 0, [2.5]), ("a", 1_000, [2.5])]
    assert all(type(value) is float for _, _, values in samples for value in values)


@pytest.mark.parametrize("silent_until_ns", [0, 1_150, 1 << 62])
@pytest.mark.parametrize("latency_ns", [0, 10, 10_000])
def test_what_is_shown_reaches_the_medium_before_all_else_at_its_instants_whatever_the_program_promises(
        conduct: Conduct, silent_until_ns: int, latency_ns: int) -> None:
    def body() -> Node:
        node = Node("z", ["wire"])
        node.promise_firm(silent_until_ns)
        for period_ns in (300, 500):
            node.show("wire", period_ns, partial(lambda period_ns: [float(period_ns), float(node.present_ns())],
                                                 period_ns))
        return node

    def talker() -> Node:               # its name precedes that of the body, so do its offers at one instant
        node = Node("a", ["wire"])
        for time_ns in range(100, 1_401, 100):
            node.call_in(time_ns, lambda _: node.ports["wire"].send(b"x"))
        return node

    done = conduct({"z": body, "a": talker}, latency_ns=latency_ns, end_ns=1_501,
                   poses={"z": ShownPose(100, ("period", "time"))})

    shown = [(time_ns, "z", [float(period_ns), float(time_ns)]) for time_ns, period_ns in sorted(
        (k * period_ns, period_ns) for period_ns in (300, 500) for k in range(1_500 // period_ns + 1))]
    sent = [(time_ns, "a", b"x") for time_ns in range(100, 1_401, 100)]
    assert done.media["wire"].took == sorted([*shown, *sent], key=lambda took: (took[0], took[1] == "a"))  # type: ignore[attr-defined]


def test_samples_and_shows_between_two_events_are_read_in_the_order_of_time(conduct: Conduct) -> None:
    """A plant that is read for both cannot go back: here shows every 700 ns, samples every 300 ns, an event at 2900."""
    read: list[int] = []

    def body() -> Node:
        node = Node("z", ["wire"], 300)
        node.signals([("p", "m")], lambda: [float(read.append(node.present_ns()) or 0)])
        node.show("wire", 700, lambda: [float(read.append(node.present_ns()) or 0)])
        node.call_in(2_900, lambda _: None)
        return node

    conduct({"z": body}, latency_ns=650, end_ns=3_500, poses={"z": ShownPose(700, ("p",))})

    assert read == sorted([*range(0, 3_500, 300), *range(0, 3_500, 700)])


def test_what_counts_late_is_asked_at_the_end_of_the_run():
    node = Node("late", [])
    asked: list[int] = []

    def count() -> None:
        asked.append(node.present_ns())
        node.count("late")

    node.before_counters(count)
    node.hello()

    assert node.advance(Grant(1, 500, False, False, [])).counters == {}
    assert node.advance(Grant(2, 900, False, True, [])).counters == {"late": 1}
    assert asked == [900]
