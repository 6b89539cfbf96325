"""Notes of a host that calls its nodes in its own process, taken at every step: compiled, a store into a field.

The guard of the run and its watchdog read it, also from other threads.
"""

from __future__ import annotations

from mypy_extensions import mypyc_attr


@mypyc_attr(allow_interpreted_subclasses=True)
class Turn:
    def __init__(self) -> None:
        self.program_runs = False                   # code of a node is running
        self.refusal: BaseException | None = None   # a way around the emulator that such code has tried
        self.steps = 0                              # how often such code has come back
