"""What bound_calls.c and ctypes_calls.py offer alike. Addresses are those of C functions and of an FMU's instance;
both have to live as long as the object. `fmi` is 2 or 3; a call that is not `brief` lets other threads run meanwhile.
"""

from collections.abc import Sequence

class BoundStep:
    last: float                 # where the last step ended [s], where the FMU tells: FMI 3.0; else not a number
    def __init__(self, function: int, instance: int, fmi: int, brief: bool) -> None: ...
    def do(self, time: float, h: float) -> int:
        """Step from `time` by `h` [s]; returns the FMI status."""
    def watch(self, word: memoryview, number: int) -> None:
        """While a call runs, `word` (one 64-bit integer, written in place) is `number`, else 0.

        ValueError or TypeError for what is not eight bytes, aligned and writable."""
    @property
    def ended(self) -> bool:
        """The FMU ended the last step early, or asks to end."""
    @property
    def asks_to_end(self) -> bool: ...

class BoundValues:
    def __init__(self, function: int, instance: int, references: Sequence[int], fmi: int, brief: bool) -> None:
        """`function` sets or gets 64-bit floating point variables."""
    def set(self, values: Sequence[float]) -> int:
        """Returns the FMI status; TypeError for what is not as many numbers as references."""
    def get(self) -> tuple[float, ...] | int:
        """The values, or the FMI status if that is neither ok nor a warning."""
    def watch(self, word: memoryview, number: int) -> None:
        """As that of BoundStep."""
