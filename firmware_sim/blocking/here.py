"""Which blocking program the calling thread belongs to: what `can.Bus(...)` and `time.sleep` have to find out.

Differs from the house rule against module-level state: code that is not ours calls with nothing in hand but its thread.
"""

from __future__ import annotations

from threading import local
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from firmware_sim.blocking.program import BlockingProgram


class _Here(local):
    program: BlockingProgram | None = None


_here = _Here()


def running() -> BlockingProgram | None:
    """The program that the calling thread belongs to, None for any other thread of the process."""
    return _here.program


def this_program() -> BlockingProgram:
    """The same for code that makes sense within a program only: `this_program().board.count("laps")`."""
    program = _here.program
    if program is None:
        raise RuntimeError("this thread belongs to no blocking program: there is one only inside `marconet run`, in "
                           "the threads of a function that is an agent's `program`")
    return program


def enter(program: BlockingProgram) -> None:
    """The calling thread belongs to `program` from now on."""
    _here.program = program
