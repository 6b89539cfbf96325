"""Computes the figures that `[expect]` bounds from a run's ledger, signals and counters, and the verdicts on them.

Frames: `frames_offered` counts frame copies, one per intended receiver and duplicate; the keys of `fate_keys` count the
copies with that fate; `delivery_ratio` = delivered / offered. Links: ages of information and successive losses are
those of the worst link, times between transmissions those of the extreme sender (see `link_metrics`). Signals:
statistics are over samples, `last_abs` = |last|, `spread_last` = largest minus smallest last value among the matching
nodes, their disagreement at the end.
With `during` only samples of that part of the run count, and frames that were offered in it.

A counter that some node reported is 0 at the nodes that did not. A counter that no node reported has no value: its name
is misspelt, or the program does not declare it and never counted.

With a pattern that matches several nodes the bound applies to each of them. The value shown is that of the node nearest
to the bound, or furthest beyond it (without a bound the largest, for `min` the smallest).

A formula of temporal logic has its robustness as its value (see `experiments.judge.formula.robustness`).

A guarantee's figures are those that its monitor found (see `experiments.judge.monitors`); it is judged only once.

A figure that cannot be measured (no frames, no such samples, a run that ended before) is nan; its verdict has no value
and does not hold.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from experiments.judge.costs import NotAccrued
from experiments.judge.costs.accrued import accrued, parts_of
from experiments.judge.formula.robustness import FormulaError, NotMeasured, robustness
from experiments.judge.frame_copies import FrameCopies
from experiments.judge.link_metrics import (
    NS_PER_S,
    age_of_information,
    successive_losses,
    times_between_transmissions,
)
from experiments.judge.monitors.outcome import Outcome
from experiments.judge.run_data import RunData
from experiments.judge.run_files import LEDGER, Json
from experiments.judge.run_result import Verdict, rated
from experiments.judge.sample_statistics import STATISTIC
from experiments.scenario.fate_keys import FATE_OF, NOT_DELIVERED
from experiments.scenario.metric_keys import (
    LATE,
    LATENESS,
    SPREAD_LAST,
    CostKey,
    CountKey,
    GuaranteeKey,
    LedgerKey,
    RealTimeKey,
    SignalKey,
    UnknownKeys,
    guarantee_figures,
    matching,
    parse,
    uncounted,
    unknown_keys,
)
from netem.records.signal_table import SignalTable

__all__ = ["Bound", "UnknownKeys", "evaluate", "measure", "unknown_keys"]


class Bound(Protocol):
    """A closed interval, in which None is no bound. `during_ns` is the part [start, end) of the run that is judged.

    With a `formula`, it is on its robustness; `links` has the links of each selector in it. With a `share`, a single
    run may be beyond it.
    """

    @property
    def min(self) -> float | None: ...

    @property
    def max(self) -> float | None: ...

    @property
    def during_ns(self) -> tuple[int, int] | None: ...

    @property
    def formula(self) -> str: ...

    @property
    def links(self) -> Mapping[str, Sequence[tuple[str, str, str]]]: ...

    @property
    def share(self) -> float | None: ...


def evaluate(expect: Mapping[str, Bound], data: RunData) -> list[Verdict]:
    """Return one verdict per key, in the order of `expect`.

    A key that names nothing in this run does not hold, and its verdict has the reason.
    """
    return [rated(_of_formula(key, bound, data) if bound.formula else _verdict(key, bound, data), bound.share)
            for key, bound in expect.items()]


def measure(key: str, data: RunData, bound: Bound | None = None) -> float:
    """Return the value of one key, nan if it cannot be measured; raises `UnknownKeys`.

    If several nodes match, `bound` decides whose value is returned.
    """
    match parse(key):
        case LedgerKey(metric, medium):
            copies = data.ledger if medium is None else data.ledger.only(medium=medium)
            if bound is not None and bound.during_ns is not None:
                offered_ns, (start_ns, end_ns) = copies.ints("offered_ns"), bound.during_ns
                copies = copies.taken((start_ns <= offered_ns) & (offered_ns < end_ns))
            return _of_ledger(metric, copies, data)
        case SignalKey() as wanted:
            return _of_signals(wanted, data, bound)
        case CountKey(pattern, counter):
            counts = [data.counters[node][counter] for node in matching(pattern, data.counters)
                      if counter in data.counters[node]]
            return float(sum(counts)) if counts else math.nan
        case CostKey(name, node) if name in (known := parts_of(data)) and (not node or node in known[name]):
            try:
                return float(accrued(name, node, data).last[-1])
            except NotAccrued:
                return math.nan
        case RealTimeKey(figure):
            return _of_real_time(figure, data.run.get("real_time") or {})
        case GuaranteeKey(name, figure) if figure in _known_guarantees(data).get(name, ()):
            return _of_guarantee(data.guarantees.get(name), figure.removesuffix("_s"))
    raise UnknownKeys("\n".join(unknown_keys([key], _known_nodes(data), data.media, _known_guarantees(data),
                                             parts_of(data))))


def _verdict(key: str, bound: Bound, data: RunData) -> Verdict:
    unknown = unknown_keys([key], _known_nodes(data), data.media, _known_guarantees(data), parts_of(data))
    why = unknown[0].removeprefix(f"expect.{key}: ") if unknown else uncounted(key, data.counters)
    if isinstance(parse(key), RealTimeKey) and not data.run.get("real_time"):
        why = "lateness is that of a run in real time: run it with --real-time"
    value = math.nan if why else measure(key, data, bound)
    if math.isnan(value):
        return Verdict(key, None, bound.min, bound.max, holds=False, why=why)
    unit = data.scenario["costs"][asked.name]["unit"] if isinstance(asked := parse(key), CostKey) else ""
    return Verdict(key, value, bound.min, bound.max, _within(value, bound), unit=unit)


def _of_formula(key: str, bound: Bound, data: RunData) -> Verdict:
    try:
        found = robustness(data, bound.formula, bound.links)
    except (NotMeasured, FormulaError) as error:
        return Verdict(key, None, bound.min, bound.max, False, str(error), bound.formula)
    holds = found.satisfied if bound.min is None and bound.max is None else _within(found.value, bound)
    return Verdict(key, found.value, bound.min, bound.max, holds, "", bound.formula, found.unit,
                   round(found.time_s * NS_PER_S), found.predicate, ", ".join(found.subjects))


def _within(value: float, bound: Bound) -> bool:
    return (bound.min is None or value >= bound.min) and (bound.max is None or value <= bound.max)


def _of_ledger(metric: str, copies: FrameCopies, data: RunData) -> float:
    if any(line.startswith(LEDGER) for line in data.missing):
        return math.nan
    match metric:
        case "frames_offered":
            return float(len(copies))
        case metric if metric == NOT_DELIVERED:
            return float(len(copies) - int(copies.delivered.sum()))
        case "delivery_ratio":
            return int(copies.delivered.sum()) / len(copies) if len(copies) else math.nan
        case "age_of_information_max_s":
            return _largest(age_of_information(copies, data.length_ns).max_s)
        case "age_of_information_mean_s":
            return _largest(age_of_information(copies, data.length_ns).mean_s)
        case "max_successive_losses":
            return float(max(successive_losses(copies).values(), default=math.nan))
        case "inter_transmission_min_s":
            return -_largest(-times_between_transmissions(copies).gap_s)
        case "inter_transmission_max_s":
            return _largest(times_between_transmissions(copies).gap_s)
    return float(copies.fate.among(FATE_OF[metric].value).sum())


def _largest(values: NDArray[np.float64]) -> float:
    return float(values.max()) if values.size else math.nan


def _of_signals(wanted: SignalKey, data: RunData, bound: Bound | None) -> float:
    tables = [data.signals[node] for node in matching(wanted.nodes, data.signals)]
    columns = [_during(table, bound).sampled(wanted.signal)[1] for table in tables if wanted.signal in table.names]
    if not columns or not all(column.size for column in columns):
        return math.nan
    if wanted.statistic == SPREAD_LAST:
        last = np.array([column[-1] for column in columns])
        return float(last.max() - last.min())
    return _worst([STATISTIC[wanted.statistic](column) for column in columns], wanted.statistic, bound)


def _of_real_time(figure: str, told: Json) -> float:
    """Return a figure of lateness in s, or the number of overruns; nan in virtual time, and without any delivery."""
    if figure in LATE:
        deliveries = told.get("deliveries") or {}
        return float(deliveries[LATE[figure]]) / NS_PER_S if deliveries.get("events") else math.nan
    found = float(told.get(LATENESS[figure], math.nan))
    return found / NS_PER_S if figure.endswith("_s") else found


def _of_guarantee(outcome: Outcome | None, figure: str) -> float:
    """Value of a guarantee's figure; nan if the run could not be judged, or for the first violation of none."""
    if outcome is None or not outcome.standing.judged:
        return math.nan
    standing = outcome.standing
    match figure:
        case "violations":
            return float(standing.violations)
        case "first_violation":
            return math.nan if standing.first is None else standing.first.from_ns / NS_PER_S
        case "violated":
            return standing.violated_ns / NS_PER_S
    value = standing.worst if figure == "worst" else standing.margin
    return math.nan if value is None else value


def _known_guarantees(data: RunData) -> dict[str, Sequence[str]]:
    return {name: guarantee_figures(guarantee["unit"])
            for name, guarantee in (data.scenario.get("guarantees") or {}).items()}


def _during(table: SignalTable, bound: Bound | None) -> SignalTable:
    if bound is None or bound.during_ns is None:
        return table
    first, end = np.searchsorted(table.time_ns, bound.during_ns)
    return replace(table, time_ns=table.time_ns[first:end], values=table.values[first:end])


def _worst(values: Sequence[float], statistic: str, bound: Bound | None) -> float:
    if any(math.isnan(value) for value in values):
        return math.nan
    lower, upper = (bound.min, bound.max) if bound else (None, None)
    if lower is None and upper is None:
        return min(values) if statistic == "min" else max(values)
    return min(values, key=lambda value: min(value - lower if lower is not None else math.inf,
                                             upper - value if upper is not None else math.inf))


def _known_nodes(data: RunData) -> dict[str, Sequence[str]] | list[str]:
    """Map nodes and derived signals to the names of their signals; if none were recorded, the list of nodes."""
    if not data.signals:
        return data.nodes
    return {node: data.signals[node].names if node in data.signals else ()
            for node in sorted({*data.nodes, *data.signals})}
