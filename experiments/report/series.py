"""The curves and tables of the report as plain lists, thinned for drawing; no layout, no colours."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from experiments.link_metrics import (
    DELIVERED,
    LINK,
    age_of_information,
    age_quantiles,
    age_steps,
    times_between_transmissions,
    transmissions,
)
from experiments.monitors.judge import VIOLATED
from experiments.report.thinning import keep
from experiments.run_data import RunData
from netem.records.signal_table import SignalTable

MARKED = {"adopted topology": "topology adopted by a node", "switched inputs": "inputs switched by a node",
          VIOLATED: "guarantee violated"}
OUTPUT = re.compile(r"y\d*")
MOST_TRANSMISSIONS = 30_000
AROUND_NS = 250_000_000         # before and after the instants that the page leads to
MOST_AROUND = 10_000
MOST_AGE_CURVES = 12
MOST_STRETCHES = 120
BINS = 60
SHARES = [k / 100 for k in range(90)] + [k / 200 for k in range(180, 201)]

Json = dict[str, Any]


def signals(data: RunData) -> list[Json]:
    """What can be chosen for drawing, each with its unit and curves: first the signals of one [derived.NAME] together,
    since somebody asked for them, then outputs (y, y1, ...) and the rest, each with one curve per node that has it."""
    found: dict[str, Json] = {}
    derived = [name for name in data.scenario.get("derived") or {} if name in data.signals]
    for node, table in sorted(data.signals.items()):
        for name, unit in zip(table.names, table.units, strict=True):
            if node not in derived:
                add_curve(found.setdefault(name, empty_entry(name, unit)), node, table, name)
    together = []
    for node in derived:
        table = data.signals[node]
        units = list(dict.fromkeys(table.units))
        entry = empty_entry(f"{node}: {', '.join(table.names)}", ", ".join(units))
        for name in table.names:
            add_curve(entry, name, table, name)
        together.append(entry)
    alone = sorted(found.values(), key=lambda entry: (OUTPUT.fullmatch(entry["name"]) is None, entry["name"]))
    return [entry for entry in (*together, *alone) if entry["samples"]]


def empty_entry(name: str, unit: str) -> Json:
    return {"name": name, "unit": unit, "curves": [], "samples": 0, "shown": 0}


def add_curve(entry: Json, label: str, table: SignalTable, name: str) -> None:
    values = table.column(name)
    kept = keep(values)
    entry["samples"] += values.size
    entry["shown"] += kept.size
    entry["curves"].append({"label": label, "t_s": (table.time_ns[kept] * 1e-9).tolist(),
                            "values": values[kept].tolist()})


def switching(data: RunData) -> Json:
    """True changes of each medium's graph, and what nodes did that marks an instant [s]."""
    changes = data.run.get("switch_instants_ns") or {}
    return {"media": {medium: [instant * 1e-9 for instant in instants] for medium, instants in changes.items()},
            "marks": [{"label": label, "events": found} for kind, label in MARKED.items()
                      if (found := [{"t_s": event.time_ns * 1e-9, "text": f"{event.node}: {kind} {event.detail}"}
                                    for event in data.events if event.kind == kind])]}


def violated(data: RunData) -> list[Json]:
    """When guarantees did not hold [s]: the longest of these stretches, at most `MOST_STRETCHES`."""
    found = [violation for outcome in data.guarantees.values() for violation in outcome.violations]
    longest = sorted(found, key=lambda violation: violation.from_ns - violation.until_ns)[:MOST_STRETCHES]
    return [{"from_s": violation.from_ns * 1e-9, "until_s": violation.until_ns * 1e-9} for violation in longest]


def spoken(data: RunData, around_ns: Sequence[int] = ()) -> Json:
    """Who spoke when: one entry per frame and what became of it, of the first `MOST_TRANSMISSIONS` frames and of those
    within `AROUND_NS` of the instants `around_ns`, of these at most `MOST_AROUND` more.

    The outcome is "delivered" if every copy was, else the commonest other fate (ties: the first by name)."""
    ledger = data.ledger
    if not ledger.height:
        return {"rows": 0, "total": 0}
    frame = ["medium", "sender", "number"]
    fates = ledger.group_by([*frame, "fate"]).len().with_columns(good=pl.col("fate") == DELIVERED)
    outcome = fates.sort(["good", "len", "fate"], descending=[False, True, False]).group_by(frame).agg(
        outcome=pl.col("fate").first(), heard=pl.col("len").filter(pl.col("good")).sum(), copies=pl.col("len").sum())
    times = ledger.group_by(frame).agg(pl.col("offered_ns", "on_air_ns", "end_ns", "size_bytes").first())
    table = times.join(outcome, on=frame).with_columns(
        start_ns=pl.when(pl.col("on_air_ns") >= 0).then("on_air_ns").otherwise("offered_ns"),
    ).sort(["start_ns", *frame])
    shown = table[_first_and_around(table["start_ns"].to_numpy(), around_ns)]
    columns: Json = {name: _coded(shown[name]) for name in ("medium", "sender", "outcome")}
    on_air = (shown["on_air_ns"] >= 0) & (shown["end_ns"] >= shown["on_air_ns"])
    columns |= {
        "start_ms": (shown["start_ns"] / 1e6).round(6).to_list(),
        "airtime_ms": ((shown["end_ns"] - shown["on_air_ns"]) / 1e6).round(6).set(~on_air, None).to_list(),
        "number": shown["number"].to_list(), "heard": shown["heard"].to_list(), "copies": shown["copies"].to_list(),
        "bytes": shown["size_bytes"].to_list(),
    }
    until_ns = table["start_ns"][min(table.height, MOST_TRANSMISSIONS) - 1]
    return columns | {"rows": shown.height, "total": table.height, "until_s": until_ns * 1e-9,
                      "around_s": AROUND_NS * 1e-9}


def _first_and_around(start_ns: NDArray[np.int64], around_ns: Sequence[int]) -> NDArray[np.intp]:
    """Indices into the sorted `start_ns`, increasing."""
    chosen = np.zeros(start_ns.size, dtype=np.bool_)
    chosen[:MOST_TRANSMISSIONS] = True
    more = MOST_AROUND
    for instant_ns in around_ns:
        first, end = np.searchsorted(start_ns, (instant_ns - AROUND_NS, instant_ns + AROUND_NS))
        more -= int(np.count_nonzero(~chosen[first:end]))
        if more < 0:
            break
        chosen[first:end] = True
    return np.flatnonzero(chosen)


def _coded(column: pl.Series) -> Json:
    """A column of few different names as codes into them."""
    names = sorted(column.unique().cast(pl.String).to_list())
    codes = column.cast(pl.String).replace_strict(names, range(len(names)), return_dtype=pl.Int32)
    return {"names": names, "codes": codes.to_list()}


def fates(data: RunData) -> list[Json]:
    """Per link: the number of copies that met each fate."""
    counts = data.ledger.group_by([*LINK, "fate"]).len().with_columns(pl.col([*LINK, "fate"]).cast(pl.String))
    links: dict[tuple[str, str, str], dict[str, int]] = {}
    for medium, sender, receiver, fate, copies in counts.sort([*LINK, "fate"]).iter_rows():
        links.setdefault((medium, sender, receiver), {})[fate] = copies
    return [{"medium": medium, "sender": sender, "receiver": receiver, "fates": found}
            for (medium, sender, receiver), found in links.items()]


def ages(data: RunData) -> Json:
    """Per link the worst first: largest, 95 %, mean age, and for the first of them the distribution over time."""
    if data.length_ns <= 0:
        return {"links": [], "shares": []}
    table = age_of_information(data.ledger, data.length_ns)
    links = table.sort(["mean_s", *LINK], descending=[True, False, False, False]).to_dicts()
    quantiles = age_quantiles(age_steps(data.ledger, data.length_ns), [0.95, *SHARES])
    for place, link in enumerate(links):
        link["p95_s"], *curve = quantiles[link["medium"], link["sender"], link["receiver"]].tolist()
        if place < MOST_AGE_CURVES:
            link["ages_ms"] = [round(age_s * 1e3, 6) for age_s in curve]
    return {"links": links, "shares": SHARES}


def gaps(data: RunData) -> list[Json]:
    """Per medium and sender the times between transmissions [ms]: one by one, thinned, over the instant at which each
    ends [s]; their histogram and their extremes."""
    table = times_between_transmissions(data.ledger)
    if not table.height:
        return []
    found = []
    for (medium,), on_medium in table.group_by(["medium"], maintain_order=True):
        all_ms = on_medium["gap_s"].to_numpy() * 1e3
        low, high = float(all_ms.min()), float(all_ms.max())
        margin = 0.02 * (high - low) or 0.05 * high or 1e-6
        edges = np.linspace(low - margin, high + margin, BINS + 1)
        for (sender,), own in on_medium.group_by(["sender"], maintain_order=True):
            own_ms = own["gap_s"].to_numpy() * 1e3
            counts, _ = np.histogram(own_ms, edges)
            kept = keep(own_ms)
            found.append({"medium": medium, "sender": sender, "edges_ms": edges.tolist(), "counts": counts.tolist(),
                          "t_s": (own["on_air_ns"].to_numpy()[kept] * 1e-9).tolist(), "gaps_ms": own_ms[kept].tolist(),
                          "transmissions": own.height + 1,
                          "min_ms": float(own_ms.min()), "mean_ms": float(own_ms.mean()),
                          "max_ms": float(own_ms.max())})
    return sorted(found, key=lambda entry: (entry["medium"], entry["sender"]))


def node_table(data: RunData) -> Json:
    """Per node: frames sent, copies heard, mean rate, samples, and the program's own counters."""
    sent = Counter(transmissions(data.ledger)["sender"].to_list())
    heard = Counter(data.ledger.filter(pl.col("fate") == DELIVERED)["receiver"].cast(pl.String).to_list())
    names = sorted({name for counters in data.counters.values() for name in counters})
    length_s = data.length_ns * 1e-9
    rows = [{"node": node, "sent": sent[node], "rate_hz": sent[node] / length_s if length_s else 0.0,
             "heard": heard[node], "samples": data.signals[node].time_ns.size if node in data.signals else 0,
             "counters": [data.counters.get(node, {}).get(name) for name in names]} for node in data.nodes]
    return {"names": names, "rows": rows}
