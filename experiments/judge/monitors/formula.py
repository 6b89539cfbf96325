"""A formula of signal temporal logic that has to hold at every instant; `on` is the formula.

    violated:  while its robustness is negative, from the instant at which it becomes so until it is not

It is judged at the instants at which the records reach as far as it looks: the last ones of a run are left out. See
`experiments.judge.formula.robustness`.
Not modelled: counters and costs, which are known when the run has ended (write them in `[expect]`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from experiments.judge.formula import curve as curves
from experiments.judge.formula.robustness import FormulaError, NotMeasured, OverTime, over_time
from experiments.judge.groups import new_group
from experiments.judge.monitors.outcome import Finding, Violation, finite, seconds
from experiments.judge.monitors.records import Records
from experiments.judge.run_data import RunData
from experiments.scenario.subjects import Named, Subject, links_in_formula


@dataclass(frozen=True)
class Formula:
    ON: ClassVar = Named.FORMULA
    UNIT: ClassVar = ""

    def requires(self) -> str:
        return "satisfied at every instant"

    def watch(self, subjects: Sequence[Subject], records: Records) -> Finding:
        formula, links = links_in_formula(subjects)
        data = RunData(records.length_ns, records.ledger, records.signals, events=records.events)
        try:
            found = over_time(data, formula, links)
        except (NotMeasured, FormulaError) as error:
            return Finding(judged=False, why=str(error))
        least = float(min(found.curve.first.min(), found.curve.last.min()))
        return Finding(list(_violations(found)), finite(least), finite(least))


def _violations(found: OverTime) -> Iterator[Violation]:
    curve = curves.split_at_zero(found.curve)
    negative = curve.first + curve.last < 0
    starts = np.flatnonzero(new_group(negative.astype(np.int64)))
    ends = np.r_[starts[1:], negative.size]
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        if not negative[start]:
            continue
        firsts, lasts = curve.first[start:end], curve.last[start:end]
        below = bool(lasts.min() < firsts.min())
        at = float(curve.t[start + 1 + int(lasts.argmin())] if below else curve.t[start + int(firsts.argmin())])
        predicate, decided_ns = found.decided(at, below)
        yield Violation(predicate, "", round(curve.t[start]), round(curve.t[end]),
                        finite(float(min(firsts.min(), lasts.min()))),
                        f"decides at {seconds(round(decided_ns))}")
