"""Lateness of a run in real time, for the page: a histogram in logarithmic bins, ten to a decade, and its figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import floor, log10
from typing import Any, Final

from experiments.judge.run_data import RunData

Json = dict[str, Any]
BINS_PER_DECADE: Final = 10
LEAST_NS: Final = 1_000             # what is less late is in the first bin
KINDS: Final = ("deliveries", "instants")


def lateness(data: RunData) -> Json | None:
    """Return the lateness of deliveries and instants with limit, rate and scheduling; None in virtual time."""
    told = data.run.get("real_time")
    if not told or "histogram" not in told:
        return None
    of = {"deliveries": told["deliveries"], "instants": {**told, "events": told["instants"]}}
    kinds = [{"name": kind, **_binned(of[kind]["histogram"]), "events": of[kind]["events"],
              **{figure: of[kind][f"{figure}_ns"] / 1e6 for figure in ("median", "p99", "worst")}}
             for kind in KINDS if of[kind]["events"]]
    return {"kinds": kinds, "limit_ms": told["overrun_limit_ns"] / 1e6, "rate": told["rate"],
            "overruns": told["overruns"], "scheduling": _scheduling(told)} if kinds else None


def _binned(histogram: Sequence[Sequence[int]]) -> Json:
    """Return the lower edges of the bins that are not empty, as log10 of ms, and the events in each."""
    bins: Counter[int] = Counter()
    for upper_ns, events in histogram:
        bins[floor(BINS_PER_DECADE * log10(max(upper_ns, LEAST_NS) / 1e6))] += events
    return {"from_log_ms": [k / BINS_PER_DECADE for k in sorted(bins)], "counts": [bins[k] for k in sorted(bins)]}


def _scheduling(told: Json) -> str:
    if told["scheduling"] == "usual":
        return "usual scheduling, as the scenario asks for"
    return "; ".join(told["not_allowed"]) or "real-time scheduling (SCHED_FIFO), memory locked, processors kept awake"
