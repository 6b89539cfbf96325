"""Measures the Zenoh gateway: messages of 64 bytes from a program at one robot to one at another.

    router      both programs at one session in router mode, in a process of its own
    gateways    each at the gateway of its robot, all in one process, a frame that leaves one enters the other
    doors       as gateways, each behind a TLS door: two handshakes, encryption and one more process on the way
    run         each at its gateway in a run in real time, over a packet network of 1 Gbit/s without delay

For each, the messages lost and the latency from the call of `put` to the callback. They take turns, so that their
ratios are of one state of the machine.

    python -m benchmarks.zenoh_gateway [MESSAGES A SECOND] [SECONDS]
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from experiments.run.runner import run
from experiments.scenario import load
from netem.gateways.tls_front import TlsFront
from netem.gateways.zenoh import ZenohGateway, ZenohSettings
from netem.media.answers import DatagramFormat
from tests.free_port import free_port
from tests.netem.gateways.certificate_folders import make, zenoh_settings

TURNS = 3
ROUTER = """
import json, sys, time, zenoh
config = zenoh.Config()
for key, value in {"mode": "router", "listen/endpoints": [sys.argv[1]], "scouting/multicast/enabled": False}.items():
    config.insert_json5(key, json.dumps(value))
with zenoh.open(config):
    sys.stdin.read()
"""
HEAD = """
import json, sys, time, zenoh
end, per_s, seconds, more = sys.argv[1:]
config = zenoh.Config()
for key, value in {"mode": "client", "connect/endpoints": [end], "connect/timeout_ms": 30_000,
                   "scouting/multicast/enabled": False, **json.loads(more)}.items():
    config.insert_json5(key, json.dumps(value))
count, period_ns = int(float(per_s) * float(seconds)), int(1e9 / float(per_s))
"""
TALKER = HEAD + """
with zenoh.open(config) as session:
    publisher = session.declare_publisher("bench/a", congestion_control=zenoh.CongestionControl.BLOCK)
    while not publisher.matching_status.matching:
        time.sleep(0.01)
    time.sleep(0.5)
    start_ns = time.monotonic_ns()
    for k in range(count):
        wait_ns = start_ns + k * period_ns - time.monotonic_ns()
        if wait_ns > 0:
            time.sleep(wait_ns * 1e-9)
        publisher.put(b"%20d" % time.monotonic_ns() + b"." * 44)
    time.sleep(0.5)
"""
LISTENER = HEAD + """
latencies_ns = []
with zenoh.open(config) as session:
    subscriber = session.declare_subscriber("bench/a", lambda sample: latencies_ns.append(
        time.monotonic_ns() - int(sample.payload.to_bytes()[:20])))
    sys.stdin.read()
print(json.dumps(latencies_ns))
"""
SCENARIO = """# Question: how late is a message?
seed = 1
length_s = {length_s}
sample_period_ms = 0
[media.lan]
kind = "packet_network"
rate_bps = 1_000_000_000
[gateways.r1]
kind = "zenoh"
medium = "lan"
listen = "{r1}"
[gateways.r2]
kind = "zenoh"
medium = "lan"
listen = "{r2}"
"""


@dataclass(frozen=True)
class End:
    """Where a program connects, and its further settings."""

    endpoint: str
    settings: Mapping[str, Any] = field(default_factory=dict)


def main() -> None:
    per_s, seconds = (float(text) for text in (sys.argv[1:] + ["5000", "4"])[:2])
    latencies: dict[str, list[float]] = {}
    for _ in range(TURNS):
        for name, place in PLACES.items():
            with place(seconds) as ends:
                sent, found = exchange(ends, per_s, seconds)
            found_us = np.array(found) / 1e3
            print(f"{name:9} {sent:6} sent, {sent - len(found):5} lost, median {np.median(found_us):7.0f} us, "
                  f"99 % {np.quantile(found_us, 0.99):7.0f} us", flush=True)
            latencies.setdefault(name, []).extend(found)
    for name, beside in (("gateways", "router"), ("run", "router"), ("doors", "gateways")):
        ratios = [np.quantile(latencies[name], q) / np.quantile(latencies[beside], q) for q in (0.5, 0.99)]
        print(f"{name:9} {ratios[0]:.2f} times the median of {beside}, {ratios[1]:.2f} times its 99 %")


def exchange(ends: tuple[End, End], per_s: float, seconds: float) -> tuple[int, list[float]]:
    """Return the messages sent, and how long each that arrived took [ns]."""
    to, at = ([end.endpoint, str(per_s), str(seconds), json.dumps(end.settings)] for end in ends)
    with subprocess.Popen([sys.executable, "-c", LISTENER, *at], stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE, text=True) as listener:
        subprocess.run([sys.executable, "-c", TALKER, *to], check=True)
        out, _ = listener.communicate()
    return int(per_s * seconds), json.loads(out)


@contextmanager
def routed(seconds: float) -> Iterator[tuple[End, End]]:
    end = End(f"tcp/127.0.0.1:{free_port()}")
    with subprocess.Popen([sys.executable, "-c", ROUTER, end.endpoint], stdin=subprocess.PIPE) as router:
        yield end, end
        assert router.stdin is not None
        router.stdin.close()


@contextmanager
def direct(seconds: float, protocol: str = "tcp") -> Iterator[tuple[End, End]]:
    names = ["r1", "r2"]
    gateways = [ZenohGateway(name, "air", ZenohSettings(listen=f"{protocol}/127.0.0.1:0")) for name in names]
    for gateway in gateways:
        gateway.join(names, DatagramFormat(None, addressed=False))
    with _locked(gateways) if protocol == "tls" else nullcontext([{}, {}]) as settings, _joined(gateways):
        one, other = (End(gateway.locators()[0], each) for gateway, each in zip(gateways, settings, strict=True))
        yield one, other
    for gateway in gateways:
        gateway.close()


@contextmanager
def _locked(gateways: Sequence[ZenohGateway]) -> Iterator[list[dict[str, Any]]]:
    """Put a TLS door before each gateway; yield the settings of their programs."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "certificates"
        make(folder, *(gateway.name for gateway in gateways))
        front = TlsFront(folder)
        for gateway in gateways:
            door = gateway.settings.door(gateway.name)
            assert door is not None
            gateway.opened(front.open(gateway.name, door, gateway.onward(), gateway.tell))
        yield [zenoh_settings(folder, gateway.name) for gateway in gateways]
        front.close()


@contextmanager
def _joined(gateways: Sequence[ZenohGateway]) -> Iterator[None]:
    """Let a frame that leaves one gateway enter the other."""
    over = threading.Event()

    def carry() -> None:
        import select
        while not over.is_set():
            select.select(gateways, [], [], 0.001)
            for here, there in ((gateways[0], gateways[1]), (gateways[1], gateways[0])):
                for frame in here.receive(100):
                    there.send(frame)

    with in_thread(carry):
        yield
        over.set()


@contextmanager
def in_a_run(seconds: float) -> Iterator[tuple[End, End]]:
    ends = {name: f"tcp/127.0.0.1:{free_port()}" for name in ("r1", "r2")}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "case.toml"
        path.write_text(SCENARIO.format(length_s=seconds + 6, **ends))
        with in_thread(lambda: run(load(path), host="inline", out=Path(folder) / "run", report=False, real_time=True)):
            yield End(ends["r1"]), End(ends["r2"])


@contextmanager
def in_thread(work: Callable[[], object]) -> Iterator[None]:
    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield
    finally:
        thread.join()


PLACES: Mapping[str, Callable[[float], AbstractContextManager[tuple[End, End]]]] = {
    "router": routed, "gateways": direct, "doors": partial(direct, protocol="tls"), "run": in_a_run}

if __name__ == "__main__":
    main()
