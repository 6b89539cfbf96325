"""What a program may not open in virtual time, on both hosts, and what it may."""

from __future__ import annotations

import _thread
import asyncio
import socket
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from experiments.run.exits import ExitCode, exit_code_of
from experiments.run.runner import run
from experiments.scenario import load
from netem.node.outside_guard import OutsideGuard, OutsideRefused
from netem.wire.errors import NodeFailure

CASES = Path(__file__).parents[2] / "cases"
SCENARIO = """
# Question: is it refused?
seed = 1
length_s = 0.1
[agents.a]
program = "robot:{program}"
[media.radio]
kind = "broadcast_radio"
"""
ROBOT = '''
import socket
from contextlib import suppress
from threading import Thread

import zenoh
from zenoh import open as open_zenoh


def udp(address=("127.0.0.1", 9)):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.sendto(b"x", address)


class AtStart:
    def __init__(self, board):
        udp()


class LaterOn:
    def __init__(self, board):
        self.board = board

    def act(self):
        udp()

    def run(self):
        yield from self.board.sleep_until(50_000_000)
        self.act()
        yield from self.board.sleep_until(80_000_000)


class Swallows(LaterOn):
    def act(self):
        with suppress(BaseException):
            udp()


class InAThread(LaterOn):
    def act(self):
        thread = Thread(target=lambda: Swallows.act(self))
        thread.start()
        thread.join()


class Zenoh(LaterOn):
    def act(self):
        zenoh.open(zenoh.Config())


class ZenohByName(LaterOn):
    def act(self):
        open_zenoh(zenoh.Config())


class Scout(LaterOn):
    def act(self):
        zenoh.scout()


class Pair(LaterOn):
    def act(self):
        import asyncio
        here, there = socket.socketpair()
        with here, there:
            here.sendall(b"x")
            here.sendmsg([b"y"])
            assert there.recv(2) == b"xy"
        asyncio.new_event_loop().close()
        socket.getaddrinfo("127.0.0.1", 80)
'''
SENDING = "sending on an IP socket to 127.0.0.1:9"
RULE = ("goes past the emulator: in virtual time a program reaches others through the ports of its node only; "
        "send through a port, or run the scenario with --real-time")


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "robot.py").write_text(ROBOT)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def scenario_of(folder: Path, program: str):
    (folder / "s.toml").write_text(SCENARIO.format(program=program))
    return load(folder / "s.toml")


def line_of(text: str) -> int:
    return ROBOT.splitlines().index(text) + 1


# --- whole runs

@pytest.mark.parametrize(("program", "reason"), [
    ("AtStart", f"could not start: robot.py:{{udp}}: {SENDING} {RULE}"),
    ("LaterOn", f"its program failed at 50000000 ns: robot.py:{{udp}}: {SENDING} {RULE}"),
    ("Swallows", f"its program failed at 50000000 ns: robot.py:{{udp}}: {SENDING} {RULE}"),
    ("InAThread", f"its program failed at 50000000 ns: robot.py:{{udp}}: {SENDING} {RULE}"),
    ("Zenoh", f"its program failed at 50000000 ns: robot.py:{{zenoh}}: opening a Zenoh session {RULE}"),
    ("ZenohByName", f"its program failed at 50000000 ns: robot.py:{{by_name}}: opening a Zenoh session {RULE}"),
    ("Scout", f"its program failed at 50000000 ns: robot.py:{{scout}}: scouting for Zenoh {RULE}"),
])
def test_a_program_that_goes_past_the_emulator_is_refused_in_the_same_words_on_both_hosts(
        robot: Path, program: str, reason: str) -> None:
    places = {"udp": line_of("        out.sendto(b\"x\", address)"),
              "zenoh": line_of("        zenoh.open(zenoh.Config())"),
              "by_name": line_of("        open_zenoh(zenoh.Config())"), "scout": line_of("        zenoh.scout()")}
    failures = {}

    for host in ("inline", "process"):
        with pytest.raises(NodeFailure) as caught:
            run(scenario_of(robot, program), host=host, out=robot / host, report=False)
        failures[host] = caught.value

    assert {host: failure.reason for host, failure in failures.items()} == dict.fromkeys(
        failures, reason.format(**places))
    assert all(failure.node == "a" and exit_code_of(failure) is ExitCode.NODE_FAILED for failure in failures.values())


@pytest.mark.parametrize("host", ["inline", "process"])
def test_what_stays_inside_the_program_is_allowed(robot: Path, host: str) -> None:
    run(scenario_of(robot, "Pair"), host=host, out=robot / host, report=False)


@pytest.mark.parametrize("host", ["inline", "process"])
def test_in_real_time_a_program_may_send_on_sockets(robot: Path, host: str) -> None:
    run(scenario_of(robot, "LaterOn"), host=host, out=robot / host, report=False, real_time=True)


@pytest.mark.parametrize(("case", "place"), [
    ("bypass_socket/sock.toml", "sock.py:5: sending on an IP socket to 127.0.0.1:19191"),
])
def test_blocking_programs_are_refused(tmp_path: Path, case: str, place: str) -> None:
    with pytest.raises(NodeFailure, match=rf"its program failed at \d+ ns: \S*{place} goes past the emulator"):
        run(load(CASES / case), out=tmp_path, report=False)


def test_what_the_callers_own_threads_and_callbacks_open_is_none_of_a_runs_business(robot: Path) -> None:
    sent, stop = [], threading.Event()

    def send(progress=None):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            out.sendto(b"x", ("127.0.0.1", 9))
        sent.append(threading.current_thread())

    def harness():
        while not stop.wait(0.001):
            send()

    with ThreadPoolExecutor(1) as pool:
        pool.submit(harness)
        run(scenario_of(robot, "Pair"), host="inline", out=robot / "out", report=False, progress=send)
        stop.set()

    assert threading.current_thread() in sent
    send()                      # and after the run


# --- the guard by itself

@pytest.fixture
def guard():
    one = OutsideGuard()
    one.begin()
    try:
        yield one
    finally:
        one.end()


def inside(guard: OutsideGuard, action):
    guard.program_runs = True
    try:
        return action()
    finally:
        guard.program_runs = False


def on(family, verb, *arguments):
    def action():
        with socket.socket(family, socket.SOCK_DGRAM) as out, suppress(OSError):
            getattr(out, verb)(*arguments)

    return action


@pytest.mark.parametrize(("family", "address", "words"), [
    (socket.AF_INET, ("127.0.0.1", 9), "an IP socket to 127.0.0.1:9"),
    (socket.AF_INET6, ("::1", 9), "an IP socket to ::1:9"),
    (socket.AF_UNIX, "/nowhere", "a Unix socket to '/nowhere'"),
])
@pytest.mark.parametrize(("verb", "words_of_verb", "before"), [
    ("connect", "connecting", ()), ("bind", "binding", ()), ("sendto", "sending on", (b"x",)),
    ("sendmsg", "sending on", ([b"x"], [], 0))])
def test_every_way_out_of_every_family_is_refused(guard, family, address, words, verb, words_of_verb, before):
    with pytest.raises(OutsideRefused, match=rf"test_outside_guard\.py:\d+: {words_of_verb} {words} goes past"):
        inside(guard, on(family, verb, *before, address))

    assert guard.refusal is not None


@pytest.mark.skipif(not hasattr(socket, "AF_CAN"), reason="this Python knows no CAN sockets: it needs Linux")
def test_a_can_socket_is_refused_with_the_interface_to_name(guard):
    class CanSocket:                    # what the audit event carries: machines without CAN cannot make the real one
        family = socket.AF_CAN

    remedy = r'use can\.Bus\(interface="marconet", channel'
    with pytest.raises(OutsideRefused, match=rf"binding a CAN socket to can0 goes past the emulator: .*; {remedy}"):
        inside(guard, lambda: sys.audit("socket.bind", CanSocket(), ("can0",)))


@pytest.mark.parametrize("look_up", [lambda: socket.getaddrinfo("robot.invalid", 80),
                                     lambda: socket.gethostbyname("robot.invalid"),
                                     lambda: socket.create_connection(("robot.invalid", 80))])
def test_looking_up_a_name_is_refused(guard, look_up):
    with pytest.raises(OutsideRefused, match=r"looking up the host 'robot\.invalid' goes past"):
        inside(guard, look_up)


@pytest.mark.parametrize("host", [None, "localhost", "127.0.0.1", "::1", "fe80::1%1", b"10.0.0.1",
                                  socket.gethostname()])
def test_a_number_or_this_machine_may_be_looked_up(guard, host):
    with suppress(socket.gaierror):
        inside(guard, lambda: socket.getaddrinfo(host, 80))

    assert guard.refusal is None


def test_asyncio_may_make_its_pair_of_sockets(guard):
    assert inside(guard, lambda: asyncio.run(asyncio.sleep(0, "done"))) == "done"


def test_outside_of_a_program_nothing_is_refused(guard):
    on(socket.AF_INET, "sendto", b"x", ("127.0.0.1", 9))()

    assert guard.refusal is None


def test_threads_that_a_program_starts_are_watched_with_those_that_they_start(guard):
    caught = []

    def send():
        try:
            on(socket.AF_INET, "sendto", b"x", ("127.0.0.1", 9))()
        except OutsideRefused as refusal:
            caught.append(refusal)

    def start():
        inner = threading.Thread(target=send)
        inner.start()
        inner.join()

    outer = threading.Thread(target=start)
    inside(guard, outer.start)
    outer.join()
    threading.Thread(target=send).start()           # of the test, not of a program

    assert caught == [guard.refusal]


def test_a_thread_that_a_program_starts_without_the_class_thread_is_watched(guard):
    ended, caught = threading.Event(), []

    def send():
        try:
            on(socket.AF_INET, "sendto", b"x", ("127.0.0.1", 9))()
        except OutsideRefused as refusal:
            caught.append(refusal)
        ended.set()

    inside(guard, lambda: _thread.start_new_thread(send, ()))
    assert ended.wait(5.0)
    ended.clear()
    _thread.start_new_thread(send, ())              # of the test, not of a program
    assert ended.wait(5.0)

    assert caught == [guard.refusal]


def test_a_port_that_the_system_chooses_is_not_listened_on(guard):
    """Listening on an unbound IP socket binds it, without an audit event for binding."""
    with socket.socket() as door, pytest.raises(OutsideRefused, match=r"listening on an IP socket goes past"):
        inside(guard, door.listen)

    assert guard.refusal is not None


def test_many_runs_leave_one_hook_and_no_guard(guard):
    import netem.node.outside_guard as module

    for _ in range(3):
        other = OutsideGuard()
        other.begin()
        other.end()

    assert module._on_duty == [guard]
    assert module._hooked == [True]
