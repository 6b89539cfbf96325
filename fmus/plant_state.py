"""What a plant needs to go on in another process: the state that its FMU serializes, or a diary of the calls to it.

An FMU that cannot serialize its state is stepped again: the same calls, in the same order, give the same state to the
last bit. The diary has every step, as a step in two parts rounds differently.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import msgspec

from fmus.input_faults import Change


class PlantState(msgspec.Struct):
    now_ns: int
    point: int                                      # communication points reached, of a plant with a fixed step
    between_points: bool
    waiting: list[tuple[tuple[str, ...], list[Any]]]    # (names, values) that are set at the next such point
    stopped: str | None
    fmu: bytes                                      # serialized state; b"" if there is a diary
    diary: list[tuple[tuple[str, ...], list[Any]]]  # ((), [time, step size] [s]) for a step, else (names, values) set
    acting: dict[str, list[Change]]                 # faults of inputs, by name, and
    asked: dict[str, Any]                           # the values that were set last of those inputs


class Diary:
    """Notes the calls that step an FMU and set its variables."""

    def __init__(self) -> None:
        self.calls: list[tuple[tuple[str, ...], list[Any]]] = []

    def of_steps(self, step: Callable[[float, float], int]) -> Callable[[float, float], int]:
        """Return `step` so that its calls are noted."""
        def noted(time_s: float, length_s: float) -> int:
            self.calls.append(((), [time_s, length_s]))
            return step(time_s, length_s)
        return noted

    def of_values(self, names: tuple[str, ...], set_values: Callable[[Sequence[Any]], int],
                  ) -> Callable[[Sequence[Any]], int]:
        """Return `set_values` so that its calls, which set the variables `names`, are noted."""
        def noted(values: Sequence[Any]) -> int:
            self.calls.append((names, list(values)))
            return set_values(values)
        return noted
