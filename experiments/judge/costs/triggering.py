"""The cost of a control loop with intermittent feedback over the run [0, T] (Tolic 2012, (5.5), not discounted):

    J = integral of z' W z dt + S N(T),     N(T) the frames that the senders `on` have put on the air

With z = (x, u) and W = diag(Q, R) the integral is that of `Quadratic`. `on` names who sends a frame for each look.
Not modelled: what `Quadratic` does not model; frames without an intended receiver, of which the ledger has no row.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from experiments.judge.costs import NotAccrued
from experiments.judge.costs.quadratic import Quadratic
from experiments.judge.formula import curve as curves
from experiments.judge.formula.curve import Curve
from experiments.judge.link_metrics import transmissions
from experiments.judge.run_data import RunData
from experiments.judge.run_files import LEDGER
from experiments.scenario.metric_keys import matching
from experiments.scenario.subjects import Named


@dataclass(frozen=True)
class Triggering:
    ON: ClassVar = Named.SIGNALS
    UNIT: ClassVar = ""

    of: tuple[str, ...]                             # "node.signal"
    weights: list[float] | list[list[float]]        # the diagonal of W, or W
    on: str                                         # "medium: node", each a pattern
    per_frame: float                                # S

    def __post_init__(self) -> None:
        if not self.per_frame >= 0:
            raise ValueError(f"per_frame={self.per_frame}: expected the cost of a frame, 0 or more")
        if self.on.count(":") != 1:
            raise ValueError(f"on={self.on!r}: expected \"medium: node\", whose frames count")
        Quadratic(self.of, self.weights)

    @property
    def subjects(self) -> Sequence[str]:
        return self.of

    def accrue(self, data: RunData) -> Mapping[str, Curve]:
        if any(line.startswith(LEDGER) for line in data.missing):
            raise NotAccrued("nothing is known about frames")
        medium, _, node = (part.strip() for part in self.on.partition(":"))
        sent = transmissions(data.ledger)
        wanted = [k for k, (on, by) in enumerate(sent.source.names) if matching(medium, [on]) and matching(node, [by])]
        if not wanted:
            raise NotAccrued(f"no node that matches on={self.on!r} put a frame on the air")
        at = np.sort(sent.on_air_ns[np.isin(sent.source.codes, wanted)])
        at = at[at < data.length_ns]
        counted = curves.steps(np.r_[np.int64(0), at], self.per_frame * np.arange(at.size + 1.0), float(data.length_ns))
        return {"": curves.plus(Quadratic(self.of, self.weights).accrue(data)[""], counted)}
