"""Others on this machine who reach the port of a run: they do not take part, and they cannot spoil it.

Real Zenoh sessions, as another user where the tests run as root.
"""

from __future__ import annotations

import json
import os
import select
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest

from netem.emulator.conductor import Conductor
from netem.transport.process_host import ProcessHost
from netem.transport.zenoh_session import MOST_STRANGERS, Session, new_secret

NODE = Path(__file__).with_name("misbehaving_node.py")
END_NS = 50_000_000
Conduct = Callable[..., Conductor]
INTRUDER = """
import json, os, sys, time, zenoh
endpoint, credentials = sys.argv[1], json.loads(sys.argv[2])
if os.getuid() == 0:
    os.setgroups([]); os.setgid(65534); os.setuid(65534)
config = zenoh.Config()
for key, value in {"mode": "peer", "listen/endpoints": [], "connect/endpoints": [endpoint], "connect/timeout_ms": 0,
                   "connect/exit_on_failure": True, "scouting/multicast/enabled": False,
                   "scouting/gossip/enabled": False, "transport/unicast/qos/enabled": False,
                   "transport/unicast/lowlatency": True, **credentials}.items():
    config.insert_json5(key, json.dumps(value))
try:
    session = zenoh.open(config)
except zenoh.ZError as error:
    print("refused", flush=True)
    sys.exit()
session.declare_subscriber("**", lambda sample: print("heard", sample.key_expr, flush=True))
session.put("marconet/x/report/a", os.urandom(40))
print("joined", flush=True)
time.sleep(3)
"""


def intrude(endpoint: str, credentials: dict[str, Any]) -> str:
    found = subprocess.run([sys.executable, "-c", INTRUDER, endpoint, json.dumps(credentials)], capture_output=True,
                           text=True, timeout=60)
    return found.stdout


def a_host(logs: Path, **behaviours: str) -> ProcessHost:
    return ProcessHost([sys.executable, str(NODE)], {n: msgspec.json.encode(how) for n, how in behaviours.items()},
                       logs=logs, timeout_s=20.0)


def disturbed(host: ProcessHost, disturb: Callable[[str], None]) -> Any:
    """`host`, with `disturb` called with its endpoint once all nodes are ready."""
    def start() -> Any:
        hellos = host.start()
        disturb(host.reachable_at()[0])
        return hellos

    return SimpleNamespace(start=start, exchange=host.exchange, stop=host.stop)


@pytest.mark.parametrize("credentials", [
    {},
    {"transport/auth/usrpwd": {"user": "member", "password": "guess"}},
    {"transport/auth/usrpwd": {"user": "member", "password": ""}},
    {"transport/auth/usrpwd": {"user": "other", "password": "guess"}},
])
def test_who_does_not_know_the_secret_is_refused_and_changes_nothing(conduct: Conduct, tmp_path: Path,
                                                                     credentials: dict[str, Any]) -> None:
    samples: list[Any] = []
    said: list[str] = []
    host = a_host(tmp_path, a="well", b="well")
    try:
        conduct({}, latency_ns=100_000, end_ns=END_NS, samples=samples,
                host=disturbed(host, lambda endpoint: said.append(intrude(endpoint, credentials))))
    finally:
        host.stop()

    assert said == ["refused\n"]
    assert samples[-1] == ("b", 40_000_000, [39.0])
    assert sum(host.garbage.values()) == 0


def test_bytes_that_are_not_zenoh_change_nothing(conduct: Conduct, tmp_path: Path) -> None:
    """What talks to the port in another language, or sends a session's opening bytes with one of them changed."""
    samples: list[Any] = []
    host = a_host(tmp_path, a="well", b="well")
    opening = bytes.fromhex("1a00") + bytes(26)

    def disturb(endpoint: str) -> None:
        for k in range(60):
            with socket.create_connection(("127.0.0.1", int(endpoint.rpartition(":")[2]))) as stranger, \
                    suppress(OSError):
                mutated = bytearray(opening)
                mutated[k % len(mutated)] ^= 1 << k % 8
                stranger.sendall((b"GET / HTTP/1.1\r\n\r\n", os.urandom(1_000), bytes(mutated))[k % 3])

    try:
        conduct({}, latency_ns=100_000, end_ns=END_NS, samples=samples, host=disturbed(host, disturb))
    finally:
        host.stop()

    assert samples[-1] == ("b", 40_000_000, [39.0])


def test_connections_that_say_nothing_do_not_keep_a_member_out() -> None:
    """They hold every place for strangers until their time is over; who knows the secret tries again."""
    secret = new_secret()
    with Session(secret) as session:
        port = int(session.endpoint.rpartition(":")[2])
        strangers = [socket.create_connection(("127.0.0.1", port)) for _ in range(MOST_STRANGERS + 20)]
        try:
            with Session(secret, connect=session.endpoint) as member:
                member.sender("marconet/x/report/a").send(b"here")
        finally:
            for stranger in strangers:
                stranger.close()


def test_the_secret_is_in_no_argument_environment_log_or_record(conduct: Conduct, tmp_path: Path) -> None:
    host = a_host(tmp_path, a="well")
    secret = host._secret.encode()
    seen: list[bytes] = []

    def look(endpoint: str) -> None:
        for pid in (os.getpid(), *host._alive.pids().values()):
            seen.extend(Path(f"/proc/{pid}/{of}").read_bytes() for of in ("cmdline", "environ"))

    try:
        conduct({}, latency_ns=100_000, end_ns=END_NS, host=disturbed(host, look))
    finally:
        host.stop()

    seen.extend(file.read_bytes() for file in tmp_path.rglob("*") if file.is_file())
    assert len(seen) >= 6
    assert not [found for found in seen if secret in found]


@contextmanager
def recording_relay(port: int) -> Iterator[tuple[int, bytearray]]:
    """A TCP port that passes everything on to `port`, and what went over it."""
    passed = bytearray()
    server = socket.create_server(("127.0.0.1", 0))

    def relay() -> None:
        with server.accept()[0] as near, socket.create_connection(("127.0.0.1", port)) as far:
            other = {near: far, far: near}
            while True:
                for source in select.select([near, far], [], [])[0]:
                    data = source.recv(65536)
                    if not data:
                        return
                    passed.extend(data)
                    other[source].sendall(data)

    thread = threading.Thread(target=relay)
    thread.start()
    try:
        yield server.getsockname()[1], passed
    finally:
        server.close()
        thread.join()


def test_the_secret_never_goes_over_the_wire() -> None:
    secret = new_secret()
    with Session(secret) as session, recording_relay(int(session.endpoint.rpartition(":")[2])) as (port, passed):
        reports = session.receiver("marconet/x/report/a")
        with Session(secret, connect=f"tcp/127.0.0.1:{port}") as member:
            out = member.sender("marconet/x/report/a")
            out.await_subscriber(5.0)
            out.send(b"the message")
            heard = reports.receive()

    assert heard == ("marconet/x/report/a", b"the message")
    assert b"the message" in passed
    assert secret.encode() not in passed
    assert bytes.fromhex(secret) not in passed
    assert secret[:16].encode() not in passed


def test_a_member_of_another_run_is_refused() -> None:
    with Session(new_secret()) as session:
        said = intrude(session.endpoint, {"transport/auth/usrpwd": {"user": "member", "password": new_secret()}})

    assert said == "refused\n"


def test_closing_a_session_does_not_wait_for_one_that_does_not_read() -> None:
    """A member that is stopped, with more on its way to it than the sockets hold."""
    secret = new_secret()
    script = ("import os, signal, sys; from netem.transport.zenoh_session import Session\n"
              "session = Session(sys.stdin.readline().strip(), connect=sys.argv[1])\n"
              "grants = session.receiver('marconet/x/grant/a'); print(flush=True)\n"
              "os.kill(os.getpid(), signal.SIGSTOP)")
    session = Session(secret)
    member = subprocess.Popen([sys.executable, "-c", script, session.endpoint], stdin=subprocess.PIPE,
                              stdout=subprocess.PIPE)
    assert member.stdin is not None
    assert member.stdout is not None
    member.stdin.write(f"{secret}\n".encode())
    member.stdin.flush()
    member.stdout.readline()
    sender = session.sender("marconet/x/grant/a")

    def send_without_end() -> None:
        with suppress(Exception):                   # the session has gone
            while True:
                sender.send(bytes(3_000))

    threading.Thread(target=send_without_end, daemon=True).start()
    time.sleep(0.5)                     # until the sockets are full

    began_s = time.monotonic()
    session.close()
    took_s = time.monotonic() - began_s
    member.kill()
    member.communicate()

    assert took_s < 5.0
