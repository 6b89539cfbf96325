"""A blocking program with a process of its own, set up as it would be for an ordinary script."""

from __future__ import annotations

import os
import random
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from firmware_sim.blocking.library_time import library_in_virtual_time
from firmware_sim.blocking.node import BlockingNode
from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.board import Board


@contextmanager
def own_process(node: BlockingNode, board: Board, name: str, folder: Path, load: Callable[[], Callable[..., object]],
                parameters: Mapping[str, Any], can_buses: Sequence[str],
                own_frames: Collection[str]) -> Iterator[BlockingProgram]:
    """Load the program `name` and let it begin. It ends with the last grant of its node, or else with this context.

    It finds its folder on the path, no arguments, an empty standard input and `random` seeded from the scenario.
    """
    sys.path.append(str(folder.absolute()))
    sys.argv = [name]
    sys.stdin = open(os.devnull)                # noqa: SIM115      # the real one is the pipe to the emulator
    random.seed(board.rng.getrandbits(64))
    with library_in_virtual_time():
        program = node.program = BlockingProgram(board, load, parameters, can_buses, own_frames)
        try:
            program.begin()
            yield program
        finally:
            program.finish()
