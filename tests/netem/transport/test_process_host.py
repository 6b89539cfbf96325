"""Nodes as OS processes over Zenoh: real sessions, real processes, and what happens when one of them fails."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest

from netem.emulator.conductor import Conductor
from netem.transport.process_host import ProcessHost
from netem.transport.zenoh_session import MAX_PART_BYTES, Sender
from netem.wire import keys
from netem.wire.errors import NodeFailure
from netem.wire.messages import Grant
from tests.processes import alive

NODE = Path(__file__).with_name("misbehaving_node.py")
END_NS = 50_000_000
Conduct = Callable[..., Conductor]


def host_of(behaviours: Mapping[str, str], logs: Path, timeout_s: float = 20.0, **options: Any) -> ProcessHost:
    specifications = {name: msgspec.json.encode(how) for name, how in behaviours.items()}
    return ProcessHost([sys.executable, str(NODE)], specifications, logs=logs, timeout_s=timeout_s,
                       real_time="speaks garbage" in behaviours.values(), **options)    # it opens a session of its own


def children() -> list[str]:
    """Command lines of the processes of this test's kind that are alive or not waited for, fork servers and nodes."""
    listing = subprocess.run(["ps", "-e", "-o", "stat=,args="], capture_output=True, text=True, check=True).stdout
    return [line for line in listing.splitlines() if str(NODE) in line]


def test_processes_give_what_inline_nodes_give(conduct: Conduct, tmp_path: Path) -> None:
    names = dict.fromkeys(("a", "b", "c"), "well")
    sys.path.insert(0, str(NODE.parent))
    from misbehaving_node import build
    sys.path.remove(str(NODE.parent))
    inline_samples: list[Any] = []
    process_samples: list[Any] = []

    inline = conduct({name: lambda name=name: build(name, "well") for name in names}, latency_ns=100_000, end_ns=END_NS,
                     samples=inline_samples)
    host = host_of(names, tmp_path)
    try:
        process = conduct({}, latency_ns=100_000, end_ns=END_NS, host=host, samples=process_samples)
    finally:
        host.stop()

    assert process_samples == inline_samples
    assert process_samples[-1] == ("c", 40_000_000, [2.0 * 39])
    assert (process.windows, process.grants) == (inline.windows, inline.grants)
    assert children() == []


@pytest.mark.parametrize(("behaviour", "reason"), [
    ("crashes", r"its process was ended by SIGABRT at .*misbehaving_node.py:\d+ in misbehave \(.* 19200000 ns"),
    ("exits", r"its process exited with code 7 .*had run up to 19200000 ns.*\n.*out of memory, says the node"),
    ("raises", r"its program failed at 20000000 ns: ValueError: sensor gave -1\n"),
    ("hangs", r"no answer in window \d+ within node_timeout_s = 8 s: it hangs at .*misbehaving_node.py:\d+ in "
              r"misbehave \(.*had run up to 19200000 ns"),
    ("speaks garbage", r"no answer in window 1 within .*: it hangs at .*in speak_garbage; "
                       r"3 unreadable messages came from it"),
])
def test_a_node_that_fails_is_named_with_its_last_report(conduct: Conduct, tmp_path: Path, behaviour: str,
                                                         reason: str) -> None:
    host = host_of({"a": "well", "b": behaviour, "c": "well"}, tmp_path, timeout_s=8.0 if "within" in reason else 30.0)
    try:
        with pytest.raises(NodeFailure, match=f"node b: {reason}"):
            conduct({}, latency_ns=100_000, end_ns=END_NS, host=host)
    finally:
        host.stop()

    assert children() == []


@pytest.mark.parametrize(("behaviour", "reason"), [
    ("fails to start", r"node b: could not start: RuntimeError: no such sensor\n"),
    ("lies", r"node b: sent an invalid hello: signal 'x' twice"),
    ("never ready", r"node b: no word that it is ready within node_timeout_s = 8 s: it is still starting at .*in "
                    r"build_as_told; raise node_timeout_s if"),
])
def test_a_node_that_is_not_ready_is_named_before_time_starts(tmp_path: Path, behaviour: str, reason: str) -> None:
    host = host_of({"a": "well", "b": behaviour}, tmp_path, timeout_s=8.0 if "within" in reason else 30.0)
    try:
        with pytest.raises(NodeFailure, match=reason):
            host.start()
    finally:
        host.stop()

    assert children() == []


def test_a_process_that_never_reads_its_errand_is_named_and_ended(tmp_path: Path) -> None:
    """The start message is longer than a pipe holds, so it cannot be written either."""
    deaf = [sys.executable, "-c", f"import time; time.sleep(3600)  # {NODE}"]
    host = ProcessHost(deaf, {"a": bytes(1_000_000)}, logs=tmp_path, timeout_s=2.0)
    try:
        with pytest.raises(NodeFailure, match="node a: no word that it is ready within node_timeout_s = 2 s"):
            host.start()
    finally:
        host.stop()

    assert children() == []


def test_a_program_finds_its_standard_input_at_its_end(conduct: Conduct, tmp_path: Path) -> None:
    """It is not the pipe to the emulator: a program that reads that would hang, and take the emulator's words."""
    samples: list[Any] = []
    host = host_of({"a": "reads its standard input"}, tmp_path)
    try:
        conduct({}, latency_ns=100_000, end_ns=END_NS, host=host, samples=samples)
    finally:
        host.stop()

    assert samples[-1] == ("a", 40_000_000, [0.0])


def test_when_the_fork_server_ends_no_node_is_blamed(conduct: Conduct, tmp_path: Path) -> None:
    host = host_of({"a": "well", "b": "kills its fork server"}, tmp_path)
    try:
        with pytest.raises(NodeFailure, match="the process that nodes are forked from was ended by SIGKILL"):
            conduct({}, latency_ns=100_000, end_ns=END_NS, host=host)
    finally:
        host.stop()

    assert children() == []


def test_a_host_may_be_stopped_twice_and_before_it_was_started(tmp_path: Path) -> None:
    host = host_of({"a": "well"}, tmp_path)

    host.stop()
    host.start()
    host.stop()
    host.stop()

    assert children() == []


def test_messages_longer_than_zenoh_sends_whole_arrive_complete(conduct: Conduct, tmp_path: Path) -> None:
    samples: list[Any] = []
    host = host_of({"a": "large", "b": "well"}, tmp_path)
    try:
        conduct({}, latency_ns=100_000, end_ns=END_NS, host=host, samples=samples)
    finally:
        host.stop()

    assert samples[-1] == ("b", 40_000_000, [39.0])


def test_random_bytes_on_the_control_keys_are_counted_and_change_nothing(conduct: Conduct, tmp_path: Path) -> None:
    samples: list[Any] = []
    host = host_of({"a": "well", "b": "well"}, tmp_path)

    def start_then_disturb() -> Any:
        hellos = host.start()
        _, run = host.reachable_at()
        emulator = host._session                    # others cannot reach these keys: test_foreign_sessions.py
        assert emulator is not None
        outs = [emulator.sender(keys.report(run, name)) for name in ("a", "nobody")]
        outs += [Sender(emulator._session, keys.grant(run, "a"), b"none"), emulator.sender(keys.grant(run, "a"))]
        for out in outs:
            out.await_subscriber(5.0)
            for size in (0, 1, 3, 64, 1_000, MAX_PART_BYTES):
                out.send(os.urandom(size))
        outs[-1].send(msgspec.msgpack.encode(Grant(0, END_NS, False, False, [])))           # of a window that is over
        return hellos

    disturbed = SimpleNamespace(start=start_then_disturb, exchange=host.exchange, stop=host.stop)
    try:
        conductor = conduct({}, latency_ns=100_000, end_ns=END_NS, host=disturbed, samples=samples)
    finally:
        host.stop()

    assert samples[-1] == ("b", 40_000_000, [39.0])
    assert host.garbage["a"] > 0
    assert host.garbage["nobody"] > 0
    assert conductor.counters["a"]["garbage grants"] == 2 * 6 + 1


def test_a_grant_of_a_window_that_is_over_is_garbage(conduct: Conduct, tmp_path: Path) -> None:
    """Each grant of a window comes once more after its report: the node answers it once, and counts the other."""
    samples: list[Any] = []
    host = host_of({"a": "well", "b": "well"}, tmp_path)
    repeated = 0

    def exchange_then_repeat(grants: Any) -> Any:
        nonlocal repeated
        reports = host.exchange(grants)
        for name, grant in grants:
            if not grant.last:
                host._senders[name].send(msgspec.msgpack.encode(grant))
                repeated += 1
        return reports

    try:
        conductor = conduct({}, latency_ns=100_000, end_ns=END_NS, samples=samples,
                            host=SimpleNamespace(start=host.start, exchange=exchange_then_repeat, stop=host.stop))
    finally:
        host.stop()

    assert samples[-1] == ("b", 40_000_000, [39.0])
    assert repeated > 10
    assert sum(conductor.counters[name]["garbage grants"] for name in "ab") == repeated


def test_after_two_seconds_the_caller_learns_who_is_waited_for(conduct: Conduct, tmp_path: Path) -> None:
    told: list[tuple[list[str], float]] = []
    host = host_of({"a": "well", "b": "hangs"}, tmp_path, timeout_s=8.0,
                   waiting=lambda nodes, waited_s: told.append((list(nodes), waited_s)))
    try:
        with pytest.raises(NodeFailure, match="node b"):
            conduct({}, latency_ns=100_000, end_ns=END_NS, host=host)
    finally:
        host.stop()

    assert told[-1][0] == ["b"]
    assert told[0][1] >= 2.0


def test_a_node_that_is_stopped_says_where(conduct: Conduct, tmp_path: Path) -> None:
    host = host_of({"a": "well", "b": "stops"}, tmp_path, timeout_s=8.0)
    try:
        with pytest.raises(NodeFailure, match=r"node b: no answer .*: it is stopped \(SIGSTOP\) at .* in misbehave"):
            conduct({}, latency_ns=100_000, end_ns=END_NS, host=host)
    finally:
        host.stop()

    assert children() == []


def test_nodes_end_when_the_emulator_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "emulator.py"
    script.write_text(f"""
import sys, time, msgspec
from pathlib import Path
from netem.transport.process_host import ProcessHost
host = ProcessHost([sys.executable, {str(NODE)!r}], {{n: msgspec.json.encode("well") for n in "ab"}},
                   logs=Path({str(tmp_path)!r}), timeout_s=20)
host.start()
print(*host._processes.pids().values(), flush=True)
time.sleep(60)
""")
    emulator = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    assert emulator.stdout is not None
    nodes = [int(word) for word in emulator.stdout.readline().split()]

    emulator.send_signal(signal.SIGKILL)
    emulator.wait()
    emulator.stdout.close()

    deadline = time.monotonic() + 5.0
    while any(alive(pid) for pid in nodes) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert len(nodes) == 2
    assert not any(alive(pid) for pid in nodes)


def test_last_words_come_from_those_who_answer_and_the_wait_for_the_others_is_bounded(tmp_path: Path) -> None:
    host = host_of({"a": "well", "b": "well"}, tmp_path)
    try:
        host.start()
        stopped = host._alive.pids()["b"]
        os.kill(stopped, signal.SIGSTOP)
        began_s = time.monotonic()
        reports = host.last_words([(name, Grant(1, 0, False, True, [])) for name in ("a", "b")], 1.0)
        took_s = time.monotonic() - began_s
        os.kill(stopped, signal.SIGCONT)
    finally:
        host.stop()

    assert [name for name, _ in reports] == ["a"]
    assert 1.0 <= took_s < 5.0
