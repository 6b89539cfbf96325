"""A least time between two frames that a node offers on a medium: the bound that excludes Zeno behaviour.

    violated:  from the later of two frames that are closer than `at_least_ns`, until the earlier one + `at_least_ns`

The instants of the offers count, which the program's trigger decides, not what the medium makes of them: a radio sends
only the first of many frames at one instant. With `instant = "on_air"` their starts on the air count instead.
Source: dissertation, Remark 4 (tau_i >= rho tau*_min excludes Zeno behaviour); Heemels, Johansson, Tabuada 2012.
Not modelled: frames without an intended receiver, which the ledger does not have; frames of several kinds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from experiments.judge.groups import new_group
from experiments.judge.link_metrics import NS_PER_S, sources
from experiments.judge.monitors.link_frames import rows_of
from experiments.judge.monitors.outcome import Finding, Violation, seconds
from experiments.judge.monitors.records import Records
from experiments.judge.monitors.stretches import joined
from experiments.scenario.subjects import Named, Subject


@dataclass(frozen=True)
class InterTransmissionTime:
    ON: ClassVar = Named.SENDERS
    UNIT: ClassVar = "s"

    at_least_ns: int                # > 0
    instant: Literal["handed_out", "on_air"] = "handed_out"

    def __post_init__(self) -> None:
        if self.at_least_ns <= 0:
            raise ValueError(f"at_least_ns={self.at_least_ns}: expected more than 0")
        if self.instant not in ("handed_out", "on_air"):
            raise ValueError(f"instant={self.instant}: expected handed_out or on_air")

    def requires(self) -> str:
        return f"at least {seconds(self.at_least_ns)} from one frame {self._done()} to the next"

    def watch(self, subjects: Sequence[Subject], records: Records) -> Finding:
        column = "offered_ns" if self.instant == "handed_out" else "on_air_ns"
        source, chosen = rows_of(sources(records.ledger), subjects)
        number, time_ns = records.ledger.ints("number")[chosen], records.ledger.ints(column)[chosen]
        order = np.lexsort((number, time_ns, source))
        order = order[time_ns[order] >= 0]
        order = order[new_group(source[order], number[order])]
        source, number, time_ns = source[order], number[order], time_ns[order]
        later = np.flatnonzero(source[1:] == source[:-1]) + 1
        if not later.size:
            return Finding()
        gap_ns = time_ns[later] - time_ns[later - 1]
        least_ns = int(gap_ns.min())
        worst, margin = least_ns / NS_PER_S, (least_ns - self.at_least_ns) / NS_PER_S
        early = later[gap_ns < self.at_least_ns]
        if not early.size:
            return Finding((), worst, margin)
        until_ns = time_ns[early - 1] + min(self.at_least_ns, records.length_ns)
        firsts = joined(source[early], time_ns[early], until_ns)
        lasts = np.r_[firsts[1:], early.size] - 1
        nearest_ns = np.minimum.reduceat(gap_ns[gap_ns < self.at_least_ns], firsts)
        violations = []
        for k, (first, last) in enumerate(zip(firsts, lasts, strict=True)):
            medium, sender = subjects[int(source[early[first]])]
            row, more = int(early[first]), int(last - first)
            cause = (f"frames {number[row - 1]} and {number[row]} {self._done()} "
                     f"{seconds(int(time_ns[row] - time_ns[row - 1]))} apart"
                     + (f", and {more} more too early after them" if more else ""))
            violations.append(Violation(f"{medium}: {sender}", sender, int(time_ns[row]),
                                        min(int(until_ns[last]), records.length_ns),
                                        float(nearest_ns[k] / NS_PER_S), cause))
        return Finding(violations, worst, margin)

    def _done(self) -> str:
        return "handed out" if self.instant == "handed_out" else "on the air"
