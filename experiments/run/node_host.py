"""Makes the host of a run's nodes: one process for each, or all of them in this one."""

from __future__ import annotations

import os
import random
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Literal

import msgspec

from experiments.run.node_build import NodeSpecification, build_node
from netem.node.outside_guard import OutsideGuard
from netem.transport.diagnosis.under_way import UnderWay
from netem.transport.hosts import Host, InlineHost
from netem.transport.placement import Placement
from netem.transport.process_host import ProcessHost
from netem.transport.zenoh_session import ENTRANCES

HostName = Literal["process", "inline"]
OWN_PROGRAMS = ("agents.", "firmware_sim.")         # packages whose modules only define names when imported
FOR_ZENOH = "firmware_sim.zenoh_programs.replaced"      # imported once instead of in every node


def open_host(host: HostName, specifications: Mapping[str, NodeSpecification], at_end: ExitStack, folder: Path,
              timeout_s: float, shuffle_start: int | None, real_time: bool, priority: int, under_way: UnderWay | None,
              waits: Callable[[Sequence[str], float], None]) -> Host:
    """Return the host of the nodes specified, not started yet.

    `at_end` gets what is to be closed after an inline run, `folder` the logs of processes. `timeout_s` is the longest
    wait for a node [s of the wall clock], `shuffle_start` the seed of the order in which processes start, `priority`
    that of their real-time scheduling, 0 for none. `waits` is called with the nodes that are waited for.
    """
    if host == "inline":
        under_way = under_way or UnderWay(shared=False)
        tries = not real_time and any(specification.blocking for specification in specifications.values())
        return InlineHost({name: partial(build_node, specification, at_end, under_way, own_process=False)
                           for name, specification in specifications.items()},
                          None if real_time else OutsideGuard(ENTRANCES), under_way, timeout_s, waits,
                          lambda name, life: build_node(specifications[name], at_end, under_way, life,
                                                        own_process=False),
                          Placement(lambda: (os.getpid(),)) if tries else None)
    order = list(specifications)
    if shuffle_start is not None:
        random.Random(shuffle_start).shuffle(order)
    # -P: modules are imported from the installation or the scenario's folder, not from the current folder
    programs = sorted({specification.program.partition(":")[0] for specification in specifications.values()})
    if any(specification.zenoh is not None and specification.zenoh.media for specification in specifications.values()):
        programs.append(FOR_ZENOH)
    return ProcessHost([sys.executable, "-P", "-m", "experiments.run.node_process",
                        *(module for module in programs if module.startswith(OWN_PROGRAMS))],
                       {name: msgspec.json.encode(specifications[name]) for name in order},
                       logs=folder / "logs", timeout_s=timeout_s, real_time=real_time, priority=priority,
                       waiting=waits)
