"""How long each robot was in which mode of its hybrid automaton, why it came there, and what ended it.

A *stay* is the time from a change into a mode to the next change out of it, the death of the node, or the end of the
run; a change from a mode to itself belongs to the stay. Modes are in the order in which the automata declare them,
those of the automaton with the most robots first, so that a mode has one colour in all runs of a scenario.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from agents.hybrid.mode_change import KIND, START, ModeChange, read
from experiments.judge.run_data import RunData
from experiments.show.report.event_tables import heading, short
from netem.records import event_fields

Json = dict[str, Any]
MOST_ROWS = 300
RUN_ENDED, KILLED = "the run ended", "a fault killed the node"


class Stay(NamedTuple):
    node: str
    mode: str
    from_ns: int
    until_ns: int
    why: str                    # the cause of the change, as recorded
    by: str                     # node whose frame or sight caused it, if any
    end: str                    # the cause of the change that ended it
    end_by: str
    started: bool               # the execution of the automaton started with it


class Row(NamedTuple):
    """A stay in the table; `fields` are the named values of its cause."""

    stay: Stay
    fields: Sequence[str]
    why: str                    # "" if the cause is named values


class StayTable(NamedTuple):
    """Stays of robots whose executions start in the mode `initial`, in other modes than this one."""

    initial: str
    columns: Sequence[str]
    rows: Sequence[Row]
    total: int
    reasons: bool               # any row has a `why`


def stays(data: RunData) -> list[Stay]:
    """Return the stays of all nodes, by node and time; events that tell no change of mode are left out."""
    changes: dict[str, list[ModeChange]] = {}
    for event in data.events:
        if event.kind == KIND and (change := read(event.time_ns, event.node, event.detail)) is not None:
            changes.setdefault(event.node, []).append(change)
    deaths = data.run.get("dead_ns") or {}
    return [stay for node, made in sorted(changes.items())
            for stay in _stays(node, made, [start_ns for start_ns, _ in deaths.get(node, ())], data.length_ns)]


def _stays(node: str, changes: Sequence[ModeChange], died_ns: Sequence[int], end_ns: int) -> Iterator[Stay]:
    begun = [change for change in changes if change.before != change.after]
    for change, after in zip(begun, [*begun[1:], None], strict=True):
        until_ns, end, by = (end_ns, RUN_ENDED, "") if after is None else (after.time_ns, after.cause, after.by)
        if died := [at_ns for at_ns in died_ns if change.time_ns < at_ns <= until_ns]:
            until_ns, end, by = died[0], KILLED, ""
        yield Stay(node, change.after, change.time_ns, until_ns, change.cause, change.by, end, by,
                   change.before == START)


def mode_names(data: RunData, found: Sequence[Stay]) -> list[str]:
    """Return all modes that are declared or recorded, in the order of their colours."""
    declared: dict[str, Sequence[str]] = data.scenario.get("modes") or {}
    robots = Counter(map(tuple, declared.values()))
    named = [mode for modes, _ in sorted(robots.items(), key=lambda item: (-item[1], item[0])) for mode in modes]
    return list(dict.fromkeys([*named, *(stay.mode for stay in sorted(found, key=lambda stay: stay.from_ns))]))


def for_page(data: RunData, found: Sequence[Stay]) -> Json | None:
    """Return the stays for the page's script with the class of each node's program; None without any stay."""
    if not found:
        return None
    names = mode_names(data, found)
    agents = data.scenario.get("agents") or {}
    nodes = list(dict.fromkeys(stay.node for stay in found))
    return {"names": names, "initial": sorted({stay.mode for stay in found if stay.started}), "nodes": nodes,
            "programs": [str((agents.get(node) or {}).get("program", "")).rpartition(":")[2] for node in nodes],
            "stays": {"node": [nodes.index(stay.node) for stay in found],
                      "mode": [names.index(stay.mode) for stay in found],
                      "from_s": [stay.from_ns / 1e9 for stay in found],
                      "until_s": [stay.until_ns / 1e9 for stay in found], "why": [_cause(stay) for stay in found]}}


def _cause(stay: Stay) -> str:
    fields = event_fields.read(stay.why)
    why = stay.why if fields is None else ", ".join(f"{heading(name)} {short(value)}" for name, value in fields.items())
    return f"{why} (caused by {stay.by})" if stay.by else why


def stay_tables(data: RunData, found: Sequence[Stay]) -> list[StayTable]:
    """Return a table for each mode in which executions start, in the order of colours."""
    initial = {stay.node: stay.mode for stay in found if stay.started}
    tables = [_table(mode, [stay for stay in found if initial.get(stay.node) == mode != stay.mode])
              for mode in mode_names(data, found) if mode in initial.values()]
    return [table for table in tables if table.rows]


def _table(initial: str, found: Sequence[Stay]) -> StayTable:
    """Return the stays by time, with a column for each named value of causes."""
    listed = sorted(found, key=lambda stay: (stay.from_ns, stay.node))
    fields = [event_fields.read(stay.why) or {} for stay in listed[:MOST_ROWS]]
    names = list(dict.fromkeys(name for each in fields for name in each))
    rows = [Row(stay, [short(each.get(name, "")) for name in names], "" if each else stay.why)
            for stay, each in zip(listed, fields, strict=False)]
    return StayTable(initial, [heading(name) for name in names], rows, len(listed), any(row.why for row in rows))
