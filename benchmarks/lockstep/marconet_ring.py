"""Runs the ring in marconet: one process per node, grants and reports over Zenoh on 127.0.0.1.

    python -m benchmarks.lockstep.marconet_ring --nodes 5 --windows 2000

It has all parts of a run except files: conductor, process host, links, and a ledger that closes every copy and checks
conservation. Only the medium is the benchmark's own: `RingLink`, point to point, with one window of latency. Windows
are global, so the lead is 0.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

import msgspec

from benchmarks.lockstep.children import leave_on_sigterm
from benchmarks.lockstep.marconet_member import MEDIUM, MarconetMember
from benchmarks.lockstep.ring import Figure, Task, judge
from netem.core.agenda import Agenda
from netem.core.frame import Frame
from netem.emulator.conductor import Conductor
from netem.media.links import Links
from netem.media.medium import Medium
from netem.records.ledger import Ledger
from netem.transport.process_host import ProcessHost

MEMBER = "benchmarks.lockstep.marconet_member"
WINDOW_NS = 1_000_000


class RingLink(Medium):
    """A medium that carries each frame of node i to node i + 1 in `latency_ns`, without loss."""

    def __init__(self, nodes: int, latency_ns: int, links: Links, ledger: Ledger) -> None:
        super().__init__(MEDIUM, [f"node_{index}" for index in range(nodes)])
        self._neighbour = {f"node_{index}": f"node_{(index + 1) % nodes}" for index in range(nodes)}
        self._numbers = dict.fromkeys(self._neighbour, 0)
        self._latency_ns = latency_ns
        self._links = links
        self._ledger = ledger

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        arrival_ns = now_ns + self._latency_ns
        frame = Frame(MEDIUM, sender, self._numbers[sender], now_ns, data, on_air_ns=now_ns, end_ns=arrival_ns)
        self._numbers[sender] += 1
        self._ledger.expect(1, MEDIUM)
        self._links.receive(frame, self._neighbour[sender], arrival_ns, checksum=False)

    def lookahead_ns(self, t0_ns: int) -> int:
        return t0_ns + self._latency_ns

    def finish(self, end_ns: int) -> None:
        """Do nothing: the medium queues no frame."""


def run(task: Task, variant: str = "zenoh", limit_s: float = 120.0) -> Figure:
    end_ns = task.windows * WINDOW_NS + 1
    with tempfile.TemporaryDirectory(prefix="lockstep_marconet_") as folder:
        host = ProcessHost([sys.executable, "-m", MEMBER], {
            f"node_{index}": msgspec.json.encode(MarconetMember(index, task, folder, WINDOW_NS))
            for index in range(task.nodes)}, logs=Path(folder) / "logs", timeout_s=limit_s)
        conductor = Conductor(Agenda(), host, end_ns)
        ledger = Ledger()
        links = Links(ledger, conductor.deliver, {})
        try:
            conductor.admit(host.start(), {MEDIUM: RingLink(task.nodes, WINDOW_NS, links, ledger)})
            conductor.run()
        finally:
            host.stop()
        ledger.finish()
        return judge("marconet", task, Path(folder), f"{version('marconet')}, {variant}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=5)
    parser.add_argument("--windows", type=int, default=2000)
    parser.add_argument("--warm-up", type=int, default=50)
    parser.add_argument("--limit-s", type=float, default=120.0, help="give up after a node is silent for this long")
    given = parser.parse_args()
    leave_on_sigterm()
    print(json.dumps(asdict(run(Task(given.nodes, given.windows, given.warm_up), limit_s=given.limit_s))))


if __name__ == "__main__":
    main()
