"""Begins a blocking program with all that an ordinary script finds, on either host.

There are no arguments, standard input is empty, `random` is seeded by the scenario. In a process of its own the program
also finds its folder on `sys.path`; where programs share the process (host `inline`) they do not.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from firmware_sim.blocking.library_time import library_in_virtual_time
from firmware_sim.blocking.node import BlockingNode
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.board import Board
from firmware_sim.clock_settings import ClockSettings
from firmware_sim.sockets.interface import Interface
from firmware_sim.sockets.library_sockets import sockets_in_virtual_time


@contextmanager
def running_script(node: BlockingNode, board: Board, clock: ClockSettings, name: str, folder: Path,
                   load: Callable[[], Callable[..., object]], parameters: Mapping[str, Any], can_buses: Sequence[str],
                   own_frames: Collection[str], interfaces: Sequence[Interface], *,
                   own_process: bool) -> Iterator[BlockingProgram]:
    """Load the program `name` and begin it. It ends with the last grant of its node, at the latest with this context.

    When the context ends before, a program in a process of its own gets a Ctrl-C; one that shares it just ends.
    """
    with _standard_streams(name), library_in_virtual_time(everywhere=not own_process), sockets_in_virtual_time(
            everywhere=not own_process):
        if own_process:
            sys.path.append(str(folder.absolute()))
        program = node.program = BlockingProgram(node, board, clock, load, parameters, can_buses, own_frames,
                                                 interfaces, name)
        if not own_process:
            node.at_end(program.abandon)        # a fault may kill the node before the run ends
        try:
            program.begin()
            yield program
        finally:
            if own_process:
                program.finish()
            else:
                program.abandon()


@contextmanager
def _standard_streams(name: str) -> Iterator[None]:
    before = sys.argv, sys.stdin
    sys.argv, sys.stdin = [name], open(os.devnull)              # noqa: SIM115      # closed below
    try:
        yield
    finally:
        sys.stdin.close()
        sys.argv, sys.stdin = before
