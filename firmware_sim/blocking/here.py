"""The blocking program to which the calling thread belongs, for `can.Bus(...)` and `time.sleep`.

Differs from the rule against module-level state: other code calls these functions, and only its thread identifies it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_sim.blocking.program_thread import OF_THIS_THREAD

if TYPE_CHECKING:
    from firmware_sim.blocking.program import BlockingProgram


def running() -> BlockingProgram | None:
    """Return the program to which the calling thread belongs; None for any other thread of the process."""
    program: BlockingProgram | None = OF_THIS_THREAD.program    # no `cast`: calls cost, several a frame
    return program


def this_program() -> BlockingProgram:
    """Return the program of the calling thread; RuntimeError if there is none. `this_program().board.count("laps")`"""
    program = running()
    if program is None:
        raise RuntimeError("this thread belongs to no blocking program: there is one only inside `marconet run`, in "
                           "the threads of a function that is an agent's `program`")
    return program
