"""The process from which nodes are forked: `python -m experiments.run.node_process [MODULE ...]`.

The process host starts it. It imports the modules named, programs of marconet's own, once, before it forks nodes.
"""

from __future__ import annotations

import os
import sys
import threading
from contextlib import ExitStack
from functools import partial
from importlib import import_module
from typing import Final

import msgspec

from experiments.run.node_build import NodeSpecification, build_node
from experiments.run.wall_clock_sleep import sleep_refused
from netem.node.node import Node
from netem.node.outside_guard import post_guards
from netem.transport.diagnosis.under_way import UnderWay
from netem.transport.fork_server import serve
from netem.transport.node_link import run_node
from netem.transport.start_message import StartMessage
from netem.transport.zenoh_session import ENTRANCES

# Modules that import a library when they first need it, or when `load_library` is called.
IMPORT_LATE: Final = ("agents.tracking.heading_slope", "firmware_sim.mavlink.dialect", "netem.media.can.dbc_file")


def build(at_end: ExitStack, under_way: UnderWay, start: StartMessage) -> Node:
    return build_node(msgspec.json.decode(start.specification, type=NodeSpecification), at_end, under_way, start.life)


def run_child(under_way: UnderWay) -> int:
    with ExitStack() as at_end:
        return run_node(partial(build, at_end, under_way))


def main() -> int:
    for module in sys.argv[1:]:
        import_module(module)
    for module in IMPORT_LATE:
        if module in sys.modules:           # imported once here instead of in every node
            sys.modules[module].load_library()
    post_guards(ENTRANCES)
    with sleep_refused():                   # also in the nodes, whose main thread has the same identifier
        return serve(run_child)


if __name__ == "__main__":
    code = main()
    if any(not thread.daemon for thread in threading.enumerate() if thread is not threading.main_thread()):
        sys.stdout.flush()
        os._exit(code)          # a thread of the program did not end, and the interpreter would wait for it
    sys.exit(code)
