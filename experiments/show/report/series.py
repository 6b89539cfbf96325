"""Computes the curves and tables of the report as plain lists, thinned for drawing, without layout and colours."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from itertools import groupby, pairwise
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from experiments.judge.frame_copies import DELIVERED, LINK, Coded
from experiments.judge.groups import Ints, new_group
from experiments.judge.link_metrics import (
    age_of_information,
    age_quantiles,
    sources,
    times_between_transmissions,
    transmissions,
)
from experiments.judge.monitors.judge import VIOLATED
from experiments.judge.recorded_faults import recorded_faults
from experiments.judge.run_data import RunData
from experiments.judge.sample_statistics import mean
from experiments.show.report.thinning import keep
from netem.faults.schedule import Occurrence
from netem.records.signal_table import SignalTable

FAULT, FAULT_OVER = "fault", "fault over"
MARKED = {"adopted topology": "topology adopted by a node", "switched inputs": "inputs switched by a node",
          VIOLATED: "guarantee violated", FAULT: "fault begins"}
OUTPUT = re.compile(r"y\d*")
MOST_TRANSMISSIONS = 30_000
AROUND_NS = 250_000_000         # interval before and after each instant to which the page has a link
MOST_AROUND = 10_000
MOST_AGE_CURVES = 12
MOST_AGE_LINKS = 60
MOST_STRETCHES = 120
BINS = 60
SHARES = [k / 100 for k in range(90)] + [k / 200 for k in range(180, 201)]

Json = dict[str, Any]


def signals(data: RunData) -> list[Json]:
    """Return the entries that a reader can choose for drawing, each with its unit and curves.

    The signals of each [derived.NAME] come first, in one entry, then outputs (y, y1, ...), then others, each with a
    curve for every node that has the signal.
    """
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
    """Return the instants [s] at which the graph of each medium changes, and events of nodes to be marked."""
    changes = data.run.get("switch_instants_ns") or {}
    return {"media": {medium: [instant * 1e-9 for instant in instants] for medium, instants in changes.items()},
            "marks": [{"label": label, "events": found} for kind, label in MARKED.items()
                      if (found := [{"t_s": event.time_ns * 1e-9, "text": f"{event.node}: {kind} {event.detail}"}
                                    for event in data.events if event.kind == kind])]}


def violated(data: RunData) -> list[Json]:
    """Return the intervals [s] in which a guarantee did not hold: the longest, at most `MOST_STRETCHES`."""
    found = [violation for outcome in data.guarantees.values() for violation in outcome.violations]
    longest = sorted(found, key=lambda violation: violation.from_ns - violation.until_ns)[:MOST_STRETCHES]
    return [{"from_s": violation.from_ns * 1e-9, "until_s": violation.until_ns * 1e-9} for violation in longest]


def faulty(data: RunData) -> list[Json]:
    """Return the intervals [s] of faults that last, to the end of the run at most, with their names.

    They are the first `MOST_STRETCHES`. A fault that happens at an instant, such as a step of a clock, has none.
    """
    begun: dict[tuple[str, str], list[int]] = {}
    found: list[tuple[int, int, str]] = []
    for event in data.events:
        if event.kind == FAULT:
            begun.setdefault((event.node, event.detail), []).append(event.time_ns)
        elif event.kind == FAULT_OVER and begun.get((event.node, event.detail)):
            found.append((begun[event.node, event.detail].pop(0), event.time_ns, f"{event.node}: {event.detail}"))
    unending = _faults_to_the_end(data)
    for (node, detail), starts_ns in begun.items():
        found += [(start_ns, data.length_ns, f"{node}: {detail}") for start_ns in starts_ns
                  if any(start_ns == at_ns and f"{detail} ".startswith(f"{cause} ") for at_ns, cause in unending)]
    return [{"from_s": start_ns * 1e-9, "until_s": end_ns * 1e-9, "text": text}
            for start_ns, end_ns, text in sorted(found)[:MOST_STRETCHES]]


def _faults_to_the_end(data: RunData) -> list[tuple[int, str]]:
    """Return the start and the cause of each occurrence whose effect goes on at the end of the run."""
    with suppress(KeyError, msgspec.ValidationError):       # a run of another version
        return [(start_ns, spec.cause) for spec in recorded_faults(data.scenario)
                for start_ns, end_ns in spec.occurrences
                if spec.settings.until_ns(Occurrence(start_ns, end_ns)) >= data.length_ns > start_ns]
    return []


def spoken(data: RunData, around_ns: Sequence[int] = ()) -> Json:
    """Return transmissions by time, one entry per frame with its outcome.

    They are the first `MOST_TRANSMISSIONS` frames, and at most `MOST_AROUND` more within `AROUND_NS` of the instants
    `around_ns`. The outcome is "delivered" if every copy was, else the commonest other fate (ties: the first by name).
    """
    ledger = data.ledger
    if not len(ledger):
        return {"rows": 0, "total": 0}
    source, number = sources(ledger), ledger.ints("number")
    order = np.lexsort((number, source.codes))
    starts = np.flatnonzero(new_group(source.codes[order], number[order]))
    first = order[starts]                               # first copy of each frame in the ledger
    on_air_ns = ledger.ints("on_air_ns")[first]
    start_ns = np.where(on_air_ns >= 0, on_air_ns, ledger.ints("offered_ns")[first])
    copies, total = np.diff(np.r_[starts, order.size]), starts.size
    by_time = np.lexsort((number[first], source.codes[first], start_ns))
    until_s = float(start_ns[by_time[min(total, MOST_TRANSMISSIONS) - 1]]) * 1e-9
    shown = by_time[_first_and_around(start_ns[by_time], around_ns)]
    first, starts, copies = first[shown], starts[shown], copies[shown]
    start_ns, on_air_ns, end_ns = start_ns[shown], on_air_ns[shown], ledger.ints("end_ns")[first]
    heard, outcome = _outcomes(ledger.fate, order, starts, copies)
    of = [source.names[code] for code in source.codes[first].tolist()]
    columns: Json = {"medium": _coded([medium for medium, _ in of]), "sender": _coded([sender for _, sender in of]),
                     "outcome": _coded(outcome)}
    airtime_ms = np.round((end_ns - on_air_ns) / 1e6, 6)
    on_air = (on_air_ns >= 0) & (end_ns >= on_air_ns)
    columns |= {
        "start_ms": np.round(start_ns / 1e6, 6).tolist(),
        "airtime_ms": [lasts if aired else None
                       for lasts, aired in zip(airtime_ms.tolist(), on_air.tolist(), strict=True)],
        "number": number[first].tolist(), "heard": heard.tolist(), "copies": copies.tolist(),
        "bytes": ledger.ints("size_bytes")[first].tolist(),
    }
    return columns | {"rows": first.size, "total": total, "until_s": until_s, "around_s": AROUND_NS * 1e-9}


def _first_and_around(start_ns: NDArray[np.int64], around_ns: Sequence[int]) -> NDArray[np.intp]:
    """Return the indices of the chosen frames in the sorted `start_ns`, increasing."""
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


def _outcomes(fate: Coded, order: Ints, starts: Ints, copies: Ints) -> tuple[Ints, list[str]]:
    """Return arrived copies and outcome of each frame, whose copies are `order[start:start + copies]`."""
    frame = np.repeat(np.arange(starts.size), copies)
    rows = order[np.repeat(starts - np.r_[0, np.cumsum(copies)[:-1]], copies) + np.arange(frame.size)]
    names = len(fate.names)
    counts = np.bincount(frame * names + fate.codes[rows], minlength=starts.size * names).reshape(-1, names)
    good = np.array([name == DELIVERED for name in fate.names], dtype=np.bool_)
    heard = counts[:, good].sum(axis=1)
    commonest = np.where(heard == copies, good.argmax(), np.where(good, -1, counts).argmax(axis=1))
    return heard, [fate.names[code] for code in commonest.tolist()]


def _coded(values: Sequence[str]) -> Json:
    """Return a column of few different names as the names and codes into them."""
    names = sorted(set(values))
    place = {name: code for code, name in enumerate(names)}
    return {"names": names, "codes": [place[value] for value in values]}


def fates(data: RunData) -> list[Json]:
    """Return the number of copies by fate, for each link."""
    link, fate = data.ledger.link, data.ledger.fate
    if not len(data.ledger):
        return []
    names = len(fate.names)
    both = np.multiply(link.codes, names, dtype=np.int64) + fate.codes
    counts = np.bincount(both, minlength=len(link.names) * names).reshape(-1, names)
    return [dict(zip(LINK, name, strict=True)) | {
                "fates": {fate.names[k]: copies for k, copies in enumerate(found) if copies}}
            for name, found in zip(link.names, counts.tolist(), strict=True)]


def ages(data: RunData) -> Json:
    """Return largest, 95 % and mean age of information [s] of the links with the largest mean age, the worst first.

    The first `MOST_AGE_CURVES` of them also have the distribution over time [ms]. `total` counts all links.
    """
    if data.length_ns <= 0:
        return {"links": [], "shares": [], "total": 0}
    found = age_of_information(data.ledger, data.length_ns)
    worst = np.argsort(-found.mean_s, kind="stable")[:MOST_AGE_LINKS].tolist()
    chosen = [found.links[k] for k in worst]
    quantiles = age_quantiles(data.ledger, data.length_ns, set(chosen), [0.95, *SHARES])
    links: list[Json] = []
    for place, (k, name) in enumerate(zip(worst, chosen, strict=True)):
        p95_s, *curve = quantiles[name].tolist()
        links.append(dict(zip(LINK, name, strict=True)) | {
            "max_s": float(found.max_s[k]), "mean_s": float(found.mean_s[k]), "p95_s": p95_s})
        if place < MOST_AGE_CURVES:
            links[-1]["ages_ms"] = [round(age_s * 1e3, 6) for age_s in curve]
    return {"links": links, "shares": SHARES, "total": len(found.links)}


def gaps(data: RunData) -> list[Json]:
    """Return the times between transmissions [ms] for each medium and sender.

    Each entry has the times, thinned, with the instant at which each ends [s], their histogram and their extremes.
    """
    table = times_between_transmissions(data.ledger)
    starts = np.flatnonzero(new_group(table.source.codes))
    senders = [(table.source.names[table.source.codes[start]], slice(start, end))
               for start, end in pairwise([*starts.tolist(), table.gap_s.size])]
    found = []
    for medium, on_medium in groupby(senders, key=lambda item: item[0][0]):
        own = list(on_medium)
        all_ms = table.gap_s[own[0][1].start:own[-1][1].stop] * 1e3
        low, high = float(all_ms.min()), float(all_ms.max())
        margin = 0.02 * (high - low) or 0.05 * high or 1e-6
        edges = np.linspace(low - margin, high + margin, BINS + 1)
        for (_, sender), rows in own:
            own_ms = table.gap_s[rows] * 1e3
            counts, _ = np.histogram(own_ms, edges)
            kept = keep(own_ms)
            found.append({"medium": medium, "sender": sender, "edges_ms": edges.tolist(), "counts": counts.tolist(),
                          "t_s": (table.on_air_ns[rows][kept] * 1e-9).tolist(), "gaps_ms": own_ms[kept].tolist(),
                          "transmissions": own_ms.size + 1,
                          "min_ms": float(own_ms.min()), "mean_ms": mean(own_ms),
                          "max_ms": float(own_ms.max())})
    return found


def node_table(data: RunData) -> Json:
    """Return, for each node, frames sent, copies received, mean rate, samples, and counters above 0 at any node."""
    sent: Counter[str] = Counter()
    source = transmissions(data.ledger).source
    for (_, sender), frames in zip(source.names, source.counts().tolist(), strict=True):
        sent[sender] += frames
    heard: Counter[str] = Counter()
    link = data.ledger.link[data.ledger.delivered]
    for (_, _, receiver), copies in zip(link.names, link.counts().tolist(), strict=True):
        heard[receiver] += copies
    names = sorted({name for counters in data.counters.values() for name, count in counters.items() if count})
    length_s = data.length_ns * 1e-9
    rows = [{"node": node, "sent": sent[node], "rate_hz": sent[node] / length_s if length_s else 0.0,
             "heard": heard[node], "samples": data.signals[node].time_ns.size if node in data.signals else 0,
             "counters": [data.counters.get(node, {}).get(name) for name in names]} for node in data.nodes]
    return {"names": names, "rows": rows}
