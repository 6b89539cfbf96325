"""One node of the ring as a marconet node: `python -m benchmarks.lockstep.marconet_member`, started by `ProcessHost`.

The link has a latency of one window: a frame sent at the instant of window k is delivered at that of window k + 1.
"""

from __future__ import annotations

import sys
from collections.abc import Generator
from pathlib import Path

import msgspec
from simpy.events import Event

from benchmarks.lockstep.ring import Member, Task
from netem.node.node import Node
from netem.transport.fork_server import serve
from netem.transport.node_link import run_node
from netem.transport.start_message import StartMessage

MEDIUM = "ring"


class MarconetMember(msgspec.Struct):
    """The specification of the node's process, as JSON."""

    index: int
    task: Task
    folder: str
    window_ns: int

    def build(self) -> Node:
        node = Node(f"node_{self.index}", [MEDIUM])
        node.start(self.program(node))
        return node

    def program(self, node: Node) -> Generator[Event, None, None]:
        member = Member(self.index, self.task)
        port = node.ports[MEDIUM]
        inbox: list[bytes] = []
        port.on_receive = inbox.append
        while not member.is_done:
            out = member.turn(inbox)
            inbox.clear()
            port.send(out)
            member.finished()
            yield node.env.timeout(self.window_ns)
        member.save(Path(self.folder))


def build(start: StartMessage) -> Node:
    return msgspec.json.decode(start.specification, type=MarconetMember).build()


if __name__ == "__main__":
    sys.exit(serve(lambda under_way: run_node(build)))
