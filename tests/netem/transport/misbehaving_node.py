"""A node's process for tests of the process host: behaves as its specification says."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Generator
from typing import Any

import msgspec

from netem.node.node import Node
from netem.transport.fork_server import serve
from netem.transport.node_link import run_node
from netem.transport.start_message import StartMessage
from netem.transport.zenoh_session import Session
from netem.wire import keys
from netem.wire.messages import Hello, Report

PERIOD_NS = 1_000_000


def build(name: str, behaviour: str) -> Node:
    if behaviour == "fails to start":
        raise RuntimeError("no such sensor")
    node = Node(name, ["wire"], 10 * PERIOD_NS)
    heard: list[bytes] = []
    node.ports["wire"].on_receive = heard.append
    node.signals([("heard", "1")], lambda: (float(len(heard)),))
    if behaviour == "lies":
        node._signals.extend([("x", "m"), ("x", "m")])          # past the check of `Node.signals`

    def program() -> Generator[Any, Any, None]:
        while True:
            yield node.env.timeout(PERIOD_NS)
            if node.now_ns == 20 * PERIOD_NS:
                misbehave(behaviour)
            node.ports["wire"].send(f"{name}@{node.now_ns}".encode() + bytes(200_000 if behaviour == "large" else 0))

    node.start(program())
    return node


def misbehave(behaviour: str) -> None:
    if behaviour == "exits":
        print("out of memory, says the node", flush=True)
        os._exit(7)
    if behaviour == "kills its fork server":
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(3600)
    if behaviour == "crashes":
        os.abort()
    if behaviour == "stops":
        os.kill(os.getpid(), signal.SIGSTOP)
    if behaviour == "hangs":
        time.sleep(3600)
    if behaviour == "reads its standard input":
        assert sys.stdin.read() == ""
        assert subprocess.run(["cat"], capture_output=True, check=True).stdout == b""
    if behaviour == "raises":
        raise ValueError("sensor gave -1")


def speak_garbage(endpoint: str, secret: str, run: str, name: str) -> None:
    """Says hello as it should, then answers every grant with bytes that are no report."""
    with Session(secret, connect=endpoint) as session:
        grants = session.receiver(keys.grant(run, name))
        out = session.sender(keys.report(run, name))
        out.await_subscriber(5.0)
        out.send(msgspec.msgpack.encode(Hello(name, 0, 0, ["wire"], [])))
        while True:
            grants.receive()
            out.send(os.urandom(40))
            out.send(msgspec.msgpack.encode(Report(1, 0, 0, [], [], [], {}, "no")).replace(b"no", b"\xff\xfe"))
            out.send(msgspec.msgpack.encode(Report(999_999, 0, 0, [], [], [], {}, "")))


def build_as_told(start: StartMessage) -> Node:
    behaviour = msgspec.json.decode(start.specification, type=str)
    if behaviour == "never ready":
        time.sleep(3600)
    if behaviour == "speaks garbage":
        speak_garbage(start.endpoint, start.secret, start.run, start.node)
    return build(start.node, behaviour)


if __name__ == "__main__":
    sys.exit(serve(lambda under_way: run_node(build_as_told)))
