"""Duplication by script: exactly the named frames arrive twice. A link numbers its frames from 0.

`duplicate_frames = [3]` with `extra_delays_ms = [2.0]`: frame 3 passes, and its duplicate arrives 2 ms later. The
duplicate passes the impairments listed after this one by itself, under the number of its original. With `copy` only the
original, 0, or that duplicate of an earlier impairment, 1, 2, ..., is doubled.

Not modelled: chance (use `duplicate`); more than one duplicate of a copy (list `scripted_duplicate` twice).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from msgspec.structs import replace

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.script import Script


@dataclass
class ScriptedDuplicate(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST
    most_copies: ClassVar[int] = 2

    duplicate_frames: list[int]             # each >= 0
    extra_delays_ns: list[int]              # one for each of them, each >= 0
    copy: int | None = None                 # >= 0, None: the original and its duplicates

    def __post_init__(self) -> None:
        self._script = Script("duplicate_frames", self.duplicate_frames, "extra_delays_ns", self.extra_delays_ns,
                              self.copy)
        if wrong := [delay_ns for delay_ns in self.extra_delays_ns if delay_ns < 0]:
            raise ValueError(f"extra_delays_ns={wrong}: expected 0 or more")

    def written_out(self) -> bool:
        return True

    def carry(self, transit: Transit) -> Iterator[Transit]:
        yield transit
        extra_ns = self._script.at(transit)
        if extra_ns is not None:
            yield replace(transit, arrival_ns=transit.arrival_ns + extra_ns)
