"""How exactly a run in real time keeps its instants: sleeps, five robots at 300 Hz, and a delay of 5 ms end to end.

    python -m benchmarks.real_time [--repeat 3] [--only waits|robots|delay] [--drift-minutes 10]

1. Lateness of a wait for an absolute instant: by the time-out of a selector, by `select`, and by `Timer`.
2. Lateness of the deliveries of five robots that send to one another and to a UDP gateway at 300 Hz: in one process,
   and each a process of its own.
3. One-way delay between two programs outside, over two UDP gateways and a packet network with a delay of 5 ms; beside
   it the delay between the same programs on the loopback, and over `tc netem` in a network namespace if the kernel has
   it.

With `--drift-minutes` only this: a robot sends outside at 10 Hz for so long, and the arrivals at a socket outside, by
CLOCK_MONOTONIC, are fitted with a line, whose slope is the drift of the run. It is fitted to the medians of 100
stretches, as a single frame may be late by the load of the machine.

The machine's load is printed, as every figure depends on it.
"""

from __future__ import annotations

import argparse
import os
import select
import selectors
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Final

import numpy as np

from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import load
from netem.gateways.awake import awake
from netem.gateways.real_time_process import in_real_time
from netem.gateways.timer import Timer

MS: Final = 1_000_000
ROBOTS, RATE_HZ, LENGTH_S = 5, 300, 10.0
HOSTS: Final[tuple[HostName, ...]] = ("inline", "process")
DELAY_MS, MESSAGES = 5.0, 1_000
# Least and longest wait between two messages [s]. With the last, a message comes in just as the one before it leaves.
WAITS: Final = {"4 to 12 ms apart": (0.004, 0.012), "5 ms apart": (0.005, 0.005)}
PROGRAM: Final = """
from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    period_ns: int
    offset_ns: int


class Beacon:
    Settings = Settings

    def __init__(self, board, settings):
        self.port = board.port("net", lambda data: None)
        board.every(settings.period_ns, lambda: self.port.send(bytes([0, 1]) + b"*" + bytes(40)),
                    offset_ns=settings.offset_ns)
"""
TEAM: Final = """# Five robots that send to one another and outside at 300 Hz.
seed = 1
length_s = {length_s}
sample_period_ms = 0
[media.net]
kind = "packet_network"
rate_bps = 100_000_000
delay_ms = 1
[gateways.outside]
medium = "net"
peer = "127.0.0.1:{port}"
"""
PIPE: Final = """# What comes in at one gateway leaves at the other, 5 ms later.
seed = 1
length_s = {length_s}
sample_period_ms = 0
[agents.idle]
program = "idle:Idle"
[media.net]
kind = "packet_network"
rate_bps = 10_000_000_000
delay_ms = {delay_ms}
[gateways.left]
medium = "net"
listen = "127.0.0.1:{left}"
[gateways.right]
medium = "net"
peer = "127.0.0.1:{right}"
"""
IDLE: Final = """
class Idle:
    def __init__(self, board):
        board.port("net", lambda data: None)
"""
# Sends messages with the time of sending to a port, a wait after each; prints nothing.
SPEAKER: Final = """
import random, socket, sys, time
count, least_s, most_s = int(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3])
target = "127.0.0.1", int(sys.argv[4])
waits = random.Random(1)
speak = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
sys.stdin.readline()
for k in range(count):
    speak.sendto(bytes([0, 5]) + b"right" + time.monotonic_ns().to_bytes(8, "little"), target)
    time.sleep(waits.uniform(least_s, most_s))
"""
# Prints the one-way delays in ns of the messages that arrive at a port, once none has come for 4 s after the first.
LISTENER: Final = """
import socket, sys, time
hear = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
hear.bind(("127.0.0.1", int(sys.argv[1])))
hear.settimeout(30.0)
print("ready", flush=True)
delays = []
try:
    while True:
        data = hear.recv(1000)
        now = time.monotonic_ns()
        delays.append(now - int.from_bytes(data[-8:], "little"))
        hear.settimeout(4.0)
except TimeoutError:
    pass
print(*delays)
"""
# Prints its port, takes datagrams until its input has a line, and prints their arrivals in ns.
DRAIN: Final = """
import select, socket, sys, time
hear = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
hear.bind(("127.0.0.1", 0))
print(hear.getsockname()[1], flush=True)
came_ns = []
while True:
    ready = select.select([hear, sys.stdin], [], [])[0]
    if sys.stdin in ready:
        break
    hear.recv(65536)
    came_ns.append(time.monotonic_ns())
print(*came_ns)
"""


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", choices=("waits", "robots", "delay"), help="leave the other parts out")
    parser.add_argument("--drift-minutes", type=float, default=0.0)
    given = parser.parse_args(arguments)
    if given.drift_minutes:
        _drift(given.drift_minutes * 60)
        return
    repeat = given.repeat
    for turn in range(repeat):
        print(f"--- turn {turn + 1} of {repeat}, load {os.getloadavg()[0]:.2f} on {os.cpu_count()} cores")
        for scheduling in ("usual", "SCHED_FIFO", "SCHED_FIFO awake") if given.only in (None, "waits") else ():
            for name, sleep in (("selector's time-out", _by_selector), ("select", _by_select), ("Timer", _by_timer)):
                if scheduling == "usual":
                    late_ns = sleep(500, 1.3)
                else:
                    with ExitStack() as stack:
                        asleep = stack.enter_context(awake()) if scheduling.endswith("awake") else ""
                        refused = stack.enter_context(in_real_time(20))
                        late_ns = sleep(500, 1.3)
                    if asleep or any("scheduling" in why for why in refused):
                        continue
                _print(f"wait of 1.3 ms, {scheduling}, {name}", late_ns)
        for host in HOSTS if given.only in (None, "robots") else ():
            _team(host)
        if given.only in (None, "delay"):
            _delay()


def _by_selector(count: int, step_ms: float) -> list[int]:
    with selectors.DefaultSelector() as selector:
        return _waits(count, step_ms, lambda at_ns: selector.select((at_ns - time.monotonic_ns()) * 1e-9))


def _by_select(count: int, step_ms: float) -> list[int]:
    return _waits(count, step_ms, lambda at_ns: select.select([], [], [], max(0, at_ns - time.monotonic_ns()) * 1e-9))


def _by_timer(count: int, step_ms: float) -> list[int]:
    timer = Timer()
    with selectors.DefaultSelector() as selector:
        selector.register(timer, selectors.EVENT_READ)

        def wait(at_ns: int) -> None:
            timer.set(at_ns)
            selector.select()

        late_ns = _waits(count, step_ms, wait)
    timer.close()
    return late_ns


def _waits(count: int, step_ms: float, wait: Callable[[int], object]) -> list[int]:
    late_ns, at_ns = [], time.monotonic_ns()
    for _ in range(count):
        at_ns += round(step_ms * MS)
        wait(at_ns)
        late_ns.append(time.monotonic_ns() - at_ns)
    return late_ns


def _drift(length_s: float) -> None:
    load_before, every_s = os.getloadavg()[0], 0.1
    with tempfile.TemporaryDirectory() as place, Drain() as outside:
        folder = Path(place)
        (folder / "beacon.py").write_text(PROGRAM)
        robot = ('[agents.r]\nprogram = "beacon:Beacon"\n'
                 f"parameters = {{ period_ns = {round(every_s * 1e9)}, offset_ns = 0 }}\n")
        (folder / "one.toml").write_text(TEAM.format(length_s=length_s, port=outside.port) + robot)
        summary = run(load(folder / "one.toml"), host="inline", out=folder / "run", report=False,
                      real_time=True).summary
    came_s = np.array(outside.came_ns) * 1e-9
    due_s = every_s * np.arange(len(came_s))
    late_s = came_s - came_s[0] - due_s
    stretches = np.array_split(np.arange(len(late_s)), 100)
    ppm = np.polyfit([np.median(due_s[stretch]) for stretch in stretches],
                     [np.median(late_s[stretch]) for stretch in stretches], 1)[0] * 1e6
    tenth = len(late_s) // 10
    print(f"{length_s:g} s, {len(came_s)} frames outside, load {load_before:.2f} to {os.getloadavg()[0]:.2f}: drift "
          f"{ppm:+.4f} ppm, median lateness of the first tenth {np.median(late_s[:tenth]) * 1e3:+.3f} ms, of the "
          f"last {np.median(late_s[-tenth:]) * 1e3:+.3f} ms (from that of the first frame); wall time "
          f"{summary.wall_s:.4f} s; worst {np.max(late_s) * 1e3:.3f} ms")


def _team(host: HostName) -> None:
    with tempfile.TemporaryDirectory() as place, Drain() as outside:
        folder = Path(place)
        (folder / "beacon.py").write_text(PROGRAM)
        period_ns = round(1e9 / RATE_HZ)
        robots = "".join(f'[agents.r{k}]\nprogram = "beacon:Beacon"\nparameters = {{ period_ns = {period_ns}, '
                         f"offset_ns = {k * period_ns // ROBOTS} }}\n" for k in range(ROBOTS))
        (folder / "team.toml").write_text(TEAM.format(length_s=LENGTH_S, port=outside.port) + robots)
        summary = run(load(folder / "team.toml"), host=host, out=folder / "run", report=False, real_time=True).summary
    found = summary.real_time or {}
    late = found["deliveries"]
    within = sum(count for upper_ns, count in late["histogram"] if upper_ns <= MS)
    print(f"{ROBOTS} robots at {RATE_HZ} Hz, {host}: {late['events']} deliveries, "
          f"{100 * within / late['events']:.2f} % within 1 ms (to meet: 99 %); median {late['median_ns'] / MS:.3f}, "
          f"99 % {late['p99_ns'] / MS:.3f}, worst {late['worst_ns'] / MS:.3f} ms; instants: median "
          f"{found['median_ns'] / MS:.3f}, 99 % {found['p99_ns'] / MS:.3f} ms; {summary.code.partition(':')[0]}, "
          f"not allowed: {found['not_allowed']}")


class Drain:
    """A process outside with a socket at `port` that takes what a gateway sends.

    Its arrivals by the monotonic clock are `came_ns`, once the `with` block has ended.
    """

    def __enter__(self) -> Drain:
        self._process = subprocess.Popen([sys.executable, "-c", DRAIN], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                         text=True)
        assert self._process.stdout is not None
        self.port = int(self._process.stdout.readline())
        return self

    def __exit__(self, *exception: object) -> None:
        told, _ = self._process.communicate("over\n")
        self.came_ns = [int(word) for word in told.split()]


def _delay() -> None:
    for apart, waits_s in WAITS.items():
        left, right = _free_port(), _free_port()
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            (folder / "idle.py").write_text(IDLE)
            (folder / "pipe.toml").write_text(PIPE.format(length_s=4.0 + MESSAGES * sum(waits_s) / 2 * 1.3,
                                                          delay_ms=DELAY_MS, left=left, right=right))
            with Outside(left, right, waits_s) as begin:
                emulator = threading.Timer(1.5, begin)      # by then the gateways listen
                emulator.start()
                summary = run(load(folder / "pipe.toml"), host="inline", out=folder / "run", report=False,
                              real_time=True).summary
                emulator.join()
                emulated = begin.delays_ns()
        late = (summary.real_time or {})["deliveries"]
        _print(f"delay of {DELAY_MS:g} ms between two programs over two UDP gateways, messages {apart}, error", [
            delay_ns - round(DELAY_MS * MS) for delay_ns in emulated])
        print(f"of it in the emulator: sent late by {late['median_ns'] / MS:.3f} ms in the median, 99 % "
              f"{late['p99_ns'] / MS:.3f} ms")
        port = _free_port()
        with Outside(port, port, waits_s) as begin:
            begin()
            _print(f"the same programs without anything between, messages {apart}, delay", begin.delays_ns())
    _netem()


def _netem() -> None:
    name = f"marconet-{os.getpid()}"
    if subprocess.run(["ip", "netns", "add", name], capture_output=True, check=False).returncode:
        print("tc netem: no network namespaces here (needs root)")
        return
    try:
        within = ["ip", "netns", "exec", name]
        subprocess.run([*within, "ip", "link", "set", "lo", "up"], check=True)
        rule = ["root", "netem", "delay", f"{DELAY_MS:g}ms"]
        added = subprocess.run([*within, "tc", "qdisc", "add", "dev", "lo", *rule], capture_output=True, text=True,
                               check=False)
        if added.returncode:
            print(f"tc netem: not in this kernel ({added.stderr.strip()})")
            return
        port = _free_port()
        for apart, waits_s in WAITS.items():
            with Outside(port, port, waits_s, within) as begin:
                begin()
                _print(f"delay of {DELAY_MS:g} ms by tc netem, messages {apart}, error",
                       [delay_ns - round(DELAY_MS * MS) for delay_ns in begin.delays_ns()])
    finally:
        subprocess.run(["ip", "netns", "del", name], check=False)


class Outside:
    """Two programs outside: one sends to the port `target` once this is called, the other hears at `hears`."""

    def __init__(self, target: int, hears: int, waits_s: tuple[float, float], within: Sequence[str] = ()) -> None:
        def program(source: str, *given: object) -> subprocess.Popen[str]:
            return subprocess.Popen([*within, sys.executable, "-c", source, *map(str, given)], stdin=subprocess.PIPE,
                                    stdout=subprocess.PIPE, text=True)

        self._speaker = program(SPEAKER, MESSAGES, *waits_s, target)
        self._listener = program(LISTENER, hears)

    def __enter__(self) -> Outside:
        assert self._listener.stdout is not None
        self._listener.stdout.readline()
        return self

    def __call__(self) -> None:
        assert self._speaker.stdin is not None
        self._speaker.stdin.write("\n")
        self._speaker.stdin.flush()

    def delays_ns(self) -> list[int]:
        assert self._listener.stdout is not None
        return [int(word) for word in self._listener.stdout.readline().split()]

    def __exit__(self, *exception: object) -> None:
        for process in (self._speaker, self._listener):
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                if pipe is not None:
                    with suppress(OSError):
                        pipe.close()


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def _print(what: str, found_ns: Sequence[int]) -> None:
    if not found_ns:
        print(f"{what}: nothing arrived")
        return
    low, middle, high = np.percentile(found_ns, (1, 50, 99)) / MS
    print(f"{what}: 1 % {low:.3f}, median {middle:.3f}, 99 % {high:.3f}, worst {max(found_ns) / MS:.3f} ms "
          f"({len(found_ns)})")


if __name__ == "__main__":
    main()
