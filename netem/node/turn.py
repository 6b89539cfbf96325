"""State of a host that calls its nodes in its own process, which the guard and the watchdog read from other threads.

The host sets it at every step, which in a compiled class is a store into a field.
"""

from __future__ import annotations

from typing import Final

from mypy_extensions import mypyc_attr

# Maps the identifier of a thread that runs a node to that of the program's thread for which it waits now.
# A watchdog shows where that one is. Differs from the rule against module-level state: threads belong to the process.
STANDS_IN: Final[dict[int, int]] = {}


@mypyc_attr(allow_interpreted_subclasses=True)
class Turn:
    def __init__(self) -> None:
        self.program_runs = False                   # True while a node's code is running
        self.refusal: BaseException | None = None   # the first exception that a guard raised in such code
        self.steps = 0                              # number of times such code has returned
