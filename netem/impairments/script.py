"""What scripts of frames have in common: a value for each named frame of a link, and which copies of a frame they mean.

A link numbers the copies that enter it from 0; duplicates have the number of their original.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Generic, TypeVar

from netem.core.transit import Transit
from netem.impairments.checks import expect_at_least

Value = TypeVar("Value")


class Script(Generic[Value]):
    """`frames` under the key `name` have the values of `values_name`, in order; None for frames that have none.

    `copy` is 0 for the original, 1, 2, ... for a duplicate, None for all copies of a frame.
    """

    def __init__(self, name: str, frames: Sequence[int], values_name: str, values: Sequence[Value],
                 copy: int | None) -> None:
        if not frames:
            raise ValueError(f"{name}=[]: name at least one frame")
        if len(frames) != len(values):
            raise ValueError(f"{values_name}={list(values)}: expected one for each of {name}, {len(frames)} in all")
        wrong = [number for number in frames if number < 0]
        if wrong:
            raise ValueError(f"{name}={wrong}: expected 0 <= number")
        if twice := [number for number, times in Counter(frames).items() if times > 1]:
            raise ValueError(f"{name}={twice}: named twice; name each frame once")
        if copy is not None:
            expect_at_least("copy", copy, 0)
        self._values = dict(zip(frames, values, strict=True))
        self._copy = copy

    def at(self, transit: Transit) -> Value | None:
        return None if self._copy not in (None, transit.copy) else self._values.get(transit.number)
