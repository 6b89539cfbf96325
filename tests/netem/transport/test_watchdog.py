"""An inline run in which a node's code does not come back ends, and says whose code it was and where."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Generator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from netem.node.node import Node
from netem.transport.diagnosis.under_way import UnderWay
from netem.transport.hosts import InlineHost
from netem.transport.watchdog import last_words
from netem.wire.errors import NodeFailure
from netem.wire.messages import Grant

TIMEOUT_S = 0.3
LAST_RESORT = """
import ctypes, os, sys
from netem.transport.diagnosis.stack_dump import dump_stacks_into
from netem.transport.diagnosis.under_way import UnderWay
from netem.transport.hosts import InlineHost
from netem.transport import watchdog
from netem.wire.messages import Grant
from netem.node.node import Node
watchdog.END_AFTER_S, watchdog.FAULT_AFTER_S = 0.6, 1.5
under_way = UnderWay(int(sys.argv[1]))
dump_stacks_into(under_way)
def build():
    node = Node("bad", [])
    def program():
        yield node.env.timeout(5)
        under_way.call_word[0] = under_way.place("fmi3DoStep of plant cart")
        never_comes_back()
    node.start(program())
    return node
def never_comes_back():
    {action}
host = InlineHost({{"good": lambda: Node("good", []), "bad": build}}, under_way=under_way, timeout_s={timeout_s})
host.start()
grant = Grant(1, 10, False, False, [])
host.exchange([("good", grant), ("bad", grant)])
"""


def node_that(act: Callable[[], None], name: str = "bad") -> Node:
    node = Node(name, [])

    def program() -> Generator[Any, Any, None]:
        yield node.env.timeout(5)
        act()

    node.start(program())
    return node


def exchange(act: Callable[[], None], timeout_s: float = TIMEOUT_S, **options: Any) -> None:
    host = InlineHost({"good": lambda: Node("good", []), "bad": lambda: node_that(act)},
                      under_way=UnderWay(shared=False), timeout_s=timeout_s, **options)
    host.start()
    grant = Grant(1, 10, False, False, [])
    try:
        host.exchange([("good", grant), ("bad", grant)])
    finally:
        host.stop()


def computes_for_ever() -> None:
    while True:
        pass


def sleeps_for_ever() -> None:
    time.sleep(1e6)


def catches_what_it_can() -> None:
    began_s = time.monotonic()
    while time.monotonic() < began_s + 20:
        try:
            time.sleep(1e6)
        except BaseException:
            if time.monotonic() > began_s + 1:
                raise


@pytest.mark.parametrize("act", [computes_for_ever, sleeps_for_ever, catches_what_it_can])
def test_code_that_does_not_come_back_fails_its_node_at_its_line(act: Callable[[], None]) -> None:
    with pytest.raises(NodeFailure) as failure:
        exchange(act)

    assert failure.value.node == "bad"
    assert failure.value.reason.startswith(f"no answer within node_timeout_s = 0.3 s: it hangs at {__file__}:")
    assert failure.value.reason.endswith(f"in {act.__name__}")
    assert f"in {act.__name__}" in failure.value.detail


def test_code_that_does_not_come_back_while_its_node_is_built_may_only_be_slow() -> None:
    host = InlineHost({"good": lambda: Node("good", []), "bad": sleeps_for_ever}, under_way=UnderWay(shared=False),
                      timeout_s=TIMEOUT_S)

    with pytest.raises(NodeFailure) as failure:
        host.start()
    host.stop()

    assert failure.value.node == "bad"
    assert f"within node_timeout_s = 0.3 s: it is still starting at {__file__}:" in failure.value.reason
    assert failure.value.reason.endswith("; raise node_timeout_s if it only needs longer, as on a busy machine")


def test_a_run_in_another_thread_is_ended_too() -> None:
    failures: list[NodeFailure] = []

    def run() -> None:
        try:
            exchange(computes_for_ever)
        except NodeFailure as failure:
            failures.append(failure)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(20)

    assert [failure.node for failure in failures] == ["bad"]


def test_a_node_that_is_built_for_ever_is_named() -> None:
    host = InlineHost({"bad": sleeps_for_ever}, under_way=UnderWay(shared=False),  # type: ignore[dict-item]
                      timeout_s=TIMEOUT_S)
    try:
        with pytest.raises(NodeFailure, match=r"node bad: no answer within .* in sleeps_for_ever"):
            host.start()
    finally:
        host.stop()


def test_nodes_that_are_slow_one_after_the_other_are_not_late() -> None:
    """The time-out is for each node, not for their sum."""
    names = [f"n{k}" for k in range(8)]
    builds = {name: partial(node_that, partial(time.sleep, 0.1), name) for name in names}
    host = InlineHost(builds, under_way=UnderWay(shared=False), timeout_s=0.5)
    host.start()
    grant = Grant(1, 10, False, False, [])
    try:
        reports = host.exchange([(name, grant) for name in names])
    finally:
        host.stop()

    assert [name for name, _ in reports] == names


def test_between_the_nodes_code_nothing_is_late() -> None:
    host = InlineHost({"good": lambda: Node("good", [])}, under_way=UnderWay(shared=False), timeout_s=0.1)
    host.start()
    time.sleep(0.6)                     # the emulator works, or waits for the wall clock

    host.stop()


def test_who_is_waited_for_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("netem.transport.watchdog.WAITING_AFTER_S", 0.2)
    told: list[tuple[list[str], float]] = []

    with pytest.raises(NodeFailure):
        exchange(sleeps_for_ever, 1.0, waiting=lambda names, waited_s: told.append((list(names), waited_s)))

    assert told[0][0] == ["bad"]
    assert told[0][1] >= 0.2


@pytest.mark.parametrize(("action", "code"), [
    ("mutex = bytes(64); [ctypes.CDLL(None).pthread_mutex_lock(mutex) for _ in range(2)]", 3),     # as a foreign FMU
    ("ctypes.PyDLL(None).pause()", 1),              # holds the interpreter; the fault handler's own exit code
])
def test_the_last_resort_ends_the_process_and_leaves_its_words(action: str, code: int) -> None:
    under_way = UnderWay()
    script = LAST_RESORT.format(action=action, timeout_s=TIMEOUT_S)

    ended = subprocess.run([sys.executable, "-c", script, str(under_way.file)], pass_fds=[under_way.file],
                           capture_output=True, timeout=30)

    assert ended.returncode == code
    node, what, stack = last_words(ended.returncode, ["good", "bad"], under_way, TIMEOUT_S)
    assert node == "bad"
    assert what.startswith("no answer within node_timeout_s = 0.3 s: it hangs in fmi3DoStep of plant cart")
    assert Path(__file__).name not in stack


def test_a_process_that_crashed_says_the_same_as_that_of_one_node() -> None:
    under_way = UnderWay()
    script = LAST_RESORT.format(action="ctypes.string_at(0)", timeout_s=TIMEOUT_S)

    ended = subprocess.run([sys.executable, "-c", script, str(under_way.file)], pass_fds=[under_way.file],
                           capture_output=True, timeout=30)

    node, what, stack = last_words(ended.returncode, ["good", "bad"], under_way, TIMEOUT_S)
    assert node == "bad"
    assert what.startswith("its process was ended by SIGSEGV in fmi3DoStep of plant cart")
    assert "in never_comes_back" in stack
