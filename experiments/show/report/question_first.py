"""Puts the signal of the scenario's question first among those that the report can draw."""

from __future__ import annotations

from fnmatch import fnmatchcase

from experiments.judge.run_data import RunData
from experiments.scenario.metric_keys import nearest
from experiments.show.report.series import Json, add_curve, empty_entry, signals
from netem.records.signal_table import SignalTable

Found = list[tuple[str, str, str, SignalTable]]      # node, signal, unit, the node's samples


def question_signals(data: RunData) -> Found:
    """Return the recorded and derived signals that match `question_signal` of the scenario."""
    node_pattern, _, signal_pattern = (data.scenario.get("question_signal") or "").partition(".")
    return [(node, name, unit, table) for node, table in sorted(data.signals.items())
            if fnmatchcase(node, node_pattern) and table.time_ns.size
            for name, unit in zip(table.names, table.units, strict=True) if fnmatchcase(name, signal_pattern)]


def no_such_signal(data: RunData) -> str:
    """Return a warning if `question_signal` matches none of the run's signals, else ""."""
    wanted = data.scenario.get("question_signal") or ""
    if not wanted or not data.signals or question_signals(data):
        return ""
    known = [f"{node}.{name}" for node, table in data.signals.items() for name in table.names]
    return f"question_signal={wanted!r}: no recorded signal matches; nearest: {nearest(wanted, known) or 'none'}"


def question_first(data: RunData) -> list[Json]:
    """Return the entries of `series.signals` with one for the signals of the question in front.

    An entry with exactly these curves is not repeated.
    """
    entries = signals(data)
    found = question_signals(data)
    if not found:
        return entries
    names = sorted({name for _, name, _, _ in found})
    derived = data.scenario.get("derived") or {}
    for place, entry in enumerate(entries):
        if entry["name"] in names and len(names) == 1 and len(entry["curves"]) == len(found) and not any(
                node in derived for node, *_ in found):
            return [entries.pop(place), *entries]
    nodes = sorted({node for node, *_ in found})
    title = f"{nodes[0]}: {', '.join(names)}" if len(nodes) == 1 else ", ".join(names)
    first = empty_entry(title, ", ".join(dict.fromkeys(unit for _, _, unit, _ in found)))
    for node, name, _, table in found:
        add_curve(first, name if len(nodes) == 1 else node if len(names) == 1 else f"{node}.{name}", table, name)
    return [first, *(entry for entry in entries if (entry["name"], len(entry["curves"])) != (title, len(found)))]
