"""A medium for tests of virtual time: it carries every frame to every other node with a fixed latency."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import pytest

from netem.core.agenda import Agenda
from netem.core.frame import Frame
from netem.emulator.conductor import Conductor, Recorders
from netem.media.answers import ShownPose
from netem.media.links import Links
from netem.media.medium import Medium
from netem.node.node import Node
from netem.records.ledger import Ledger
from netem.transport.hosts import Host, InlineHost


class FixedLatency(Medium):
    def __init__(self, nodes: Sequence[str], links: Links, ledger: Ledger, latency_ns: int) -> None:
        super().__init__("wire", nodes)
        self._links = links
        self._ledger = ledger
        self._latency_ns = latency_ns
        self._number = 0
        self.took: list[tuple[int, str, object]] = []       # (time_ns, node, data offered or values shown)

    def offer(self, sender: str, data: bytes, now_ns: int) -> None:
        frame = Frame(self.name, sender, self._number, now_ns, data)
        self._number += 1
        self.took.append((now_ns, sender, data))
        receivers = [node for node in self.nodes if node != sender]
        self._ledger.expect(len(receivers))
        for receiver in receivers:
            self._links.receive(frame, receiver, now_ns + self._latency_ns, checksum=True)

    def show(self, node: str, values: Sequence[float], now_ns: int) -> None:
        self.took.append((now_ns, node, values))

    def lookahead_ns(self, t0_ns: int) -> int:
        return t0_ns + self._latency_ns

    def finish(self, end_ns: int) -> None:
        pass


Build = Callable[[], Node]


@pytest.fixture
def conduct() -> Callable[..., Conductor]:
    """Run nodes inline over a wire: conduct({"a": build_a, ...}, latency_ns=..., end_ns=...)."""

    def run(build: Mapping[str, Build], *, latency_ns: int, end_ns: int, host: Host | None = None,
            samples: list[tuple[str, int, list[float]]] | None = None,
            poses: Mapping[str, ShownPose] | None = None) -> Conductor:
        ledger = Ledger()
        kept = [] if samples is None else samples
        recorders = Recorders(sample=lambda node, time_ns, values: kept.append((node, time_ns, values)))
        conductor = Conductor(Agenda(), host or InlineHost(build), end_ns, recorders)
        links = Links(ledger, conductor.deliver, {})
        hellos = conductor.host.start()
        wire = FixedLatency(sorted(hellos), links, ledger, latency_ns)
        wire.poses = poses or {}
        conductor.admit(hellos, {"wire": wire})
        conductor.run()
        ledger.finish(end_ns=end_ns)
        return conductor

    return run
