"""Delay by script: exactly the named frames arrive later, each by its own time. A link numbers its frames from 0.

`delay_frames = [3, 7]` with `delays_ms = [20.0, 5.5]` delays two frames; all others pass at once, and may overtake
them.
Frames that enter the link outside a time window are numbered too. Duplicates have the number of their original; with
`copy` only the original, 0, or that duplicate, 1, 2, ..., is delayed.

Not modelled: chance. For a random delay use `delay`, for a recording `trace`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from msgspec.structs import replace

from netem.core.fate import Fate
from netem.core.transit import Transit
from netem.impairments import Impairment
from netem.impairments.flow import Flow
from netem.impairments.script import Script


@dataclass
class ScriptedDelay(Impairment):
    loses_as: ClassVar[Fate] = Fate.LOST
    only_delays: ClassVar[bool] = True

    delay_frames: list[int]                 # each >= 0
    delays_ns: list[int]                    # one for each of them, each > 0
    copy: int | None = None                 # >= 0, None: the original and its duplicates

    def __post_init__(self) -> None:
        self._script = Script("delay_frames", self.delay_frames, "delays_ns", self.delays_ns, self.copy)
        if wrong := [delay_ns for delay_ns in self.delays_ns if delay_ns < 1]:
            raise ValueError(f"delays_ns={wrong}: expected more than 0")

    def written_out(self) -> bool:
        return True

    def carry(self, transit: Transit) -> Iterator[Transit]:
        delay_ns = self._script.at(transit)
        yield transit if delay_ns is None else replace(transit, arrival_ns=transit.arrival_ns + delay_ns)

    def most_delay_ns(self, flow: Flow) -> int:
        """The longest delay of the script."""
        return max(self.delays_ns)
