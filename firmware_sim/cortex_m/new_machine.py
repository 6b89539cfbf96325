"""Makes the machine of a board: one that a debugger holds, if the run was started with a debugger for this robot."""

from __future__ import annotations

from collections.abc import Sequence

from firmware_sim.board import Board
from firmware_sim.cortex_m.image import Image
from firmware_sim.cortex_m.machine import Machine


def new_machine(board: Board, image: Image, clock_hz: int, cost: float, port_kinds: Sequence[int],
                parameters: Sequence[Sequence[float]], unique_id: Sequence[int]) -> Machine:
    """Return the machine, with the arguments of `Machine`; it is closed with the program."""
    if not board.debug_port:
        machine = Machine(image, clock_hz, cost, port_kinds, parameters, unique_id)
    else:
        from firmware_sim.cortex_m.gdb.machine import DebuggedMachine  # late: few runs are debugged

        machine = DebuggedMachine(board, image, clock_hz, cost, port_kinds, parameters, unique_id)
    board.at_end(machine.close)
    return machine
