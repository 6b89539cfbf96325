"""The blocking program to which the calling thread belongs, for `can.Bus(...)` and `time.sleep`.

Differs from the rule against module-level state: other code calls these functions, and only its thread identifies it.
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
    """Return the program to which the calling thread belongs; None for any other thread of the process."""
    return _here.program


def this_program() -> BlockingProgram:
    """Return the program of the calling thread; RuntimeError if there is none. `this_program().board.count("laps")`"""
    program = _here.program
    if program is None:
        raise RuntimeError("this thread belongs to no blocking program: there is one only inside `marconet run`, in "
                           "the threads of a function that is an agent's `program`")
    return program


def enter(program: BlockingProgram) -> None:
    """Make the calling thread one of `program`."""
    _here.program = program
