"""The table `[real_time]` of a scenario: how a run keeps the pace of the wall clock, if it is run in real time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final, Literal

from annotated_types import Ge, Gt, Le

from netem.gateways.lateness import OVERRUN_NS

SLOWEST: Final = 0.001
FASTEST: Final = 1000.0


@dataclass(frozen=True)
class RealTimeSettings:
    """Pace, and what happens to a run that cannot keep it.

    With `overrun` "slip" the run goes on late and catches up, as the instants keep their places on the wall clock. With
    "abort" it ends at the first event that is later than the limit.
    """

    rate: Annotated[float, Ge(SLOWEST), Le(FASTEST)] = 1.0             # virtual seconds per second of the wall clock
    overrun: Literal["slip", "abort"] = "slip"
    overrun_limit_ns: Annotated[int, Gt(0)] = OVERRUN_NS            # of the wall clock
    scheduling: Literal["real_time", "usual"] = "real_time"         # SCHED_FIFO and locked memory where allowed
