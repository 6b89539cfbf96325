"""The process of a blocking program, set up as for an ordinary script."""

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
from firmware_sim.clock_settings import ClockSettings


@contextmanager
def own_process(node: BlockingNode, board: Board, clock: ClockSettings, name: str, folder: Path,
                load: Callable[[], Callable[..., object]], parameters: Mapping[str, Any], can_buses: Sequence[str],
                own_frames: Collection[str]) -> Iterator[BlockingProgram]:
    """Load the program `name` and begin it. It ends with the last grant of its node, at the latest with this context.

    Its `folder` is on `sys.path`, there are no arguments, standard input is empty, `random` is seeded by the scenario.
    """
    sys.path.append(str(folder.absolute()))
    sys.argv = [name]
    sys.stdin = open(os.devnull)                # noqa: SIM115      # the process's own is the pipe to the emulator
    random.seed(board.rng.getrandbits(64))
    with library_in_virtual_time():
        program = node.program = BlockingProgram(node, board, clock, load, parameters, can_buses, own_frames)
        try:
            program.begin()
            yield program
        finally:
            program.finish()
