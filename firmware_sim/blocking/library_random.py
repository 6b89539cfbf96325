"""The module `random` in threads of a blocking program: its functions draw from the program's own generator.

So programs that share a process (host `inline`) draw what they would draw each in a process of its own.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any, Final

from firmware_sim.blocking.program import BlockingProgram
from firmware_sim.blocking.replacing import Replacement


def _of_the_program(name: str) -> Callable[..., Any]:
    def draw(program: BlockingProgram, *args: Any, **kwargs: Any) -> Any:
        return getattr(program.random, name)(*args, **kwargs)

    return draw


RANDOM: Final[list[Replacement]] = [
    (random, name, _of_the_program(name)) for name, value in vars(random).items()
    if not name.startswith("_") and isinstance(getattr(value, "__self__", None), random.Random)]
