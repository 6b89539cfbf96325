"""The interface that bound_calls.c and ctypes_calls.py implement alike: FMI calls whose pointers are bound beforehand.

`function` is the address of a C function and `instance` that of an FMU's instance; the caller keeps both alive as long
as the object. `fmi` is the major version of FMI, 2 or 3. A call made with `brief` keeps the interpreter lock; any other
releases the lock, so other threads run during the call.
"""

from collections.abc import Sequence

class BoundStep:
    last: float                 # time at which the last step ended [s], as an FMI 3.0 FMU reports it; nan for FMI 2.0
    def __init__(self, function: int, instance: int, fmi: int, brief: bool) -> None: ...
    def do(self, time: float, h: float) -> int:
        """Step from `time` by `h` [s]; returns the FMI status."""
    def watch(self, word: memoryview, number: int) -> None:
        """Write `number` into `word` (one 64-bit integer, in place) while a call runs, and 0 between calls.

        Raises ValueError unless `word` is eight aligned bytes, TypeError unless it is writable."""
    @property
    def ended(self) -> bool:
        """True if the FMU returned early from the last step or asks to end the simulation; always False for FMI 2.0."""
    @property
    def asks_to_end(self) -> bool:
        """True if the FMU asked, in the last step, to end the simulation."""
    @property
    def early(self) -> bool:
        """True if the FMU returned early from the last step, at `last`."""
    @property
    def needs_event(self) -> bool:
        """True if the FMU asked, in the last step, for event mode."""

class BoundValues:
    def __init__(self, function: int, instance: int, references: Sequence[int], fmi: int, brief: bool) -> None:
        """`function` sets or gets 64-bit floating point variables."""
    def set(self, values: Sequence[float]) -> int:
        """Set one value for each reference; returns the FMI status. Raises TypeError for any other count or type."""
    def get(self) -> tuple[float, ...] | int:
        """Return one value for each reference, or the FMI status if that is neither OK nor a warning."""
    def watch(self, word: memoryview, number: int) -> None:
        """Write `number` into `word` while a call runs, as `BoundStep.watch` does."""
