"""The keys of `[expect]`, each of which names a figure of a run.

Metrics, media, nodes and guarantees are checked before the run, signals when every node has declared its own, counters
after the run. An expectation whose key names no figure does not hold.

    <metric>                        delivery_ratio, frames_collided, age_of_information_max_s, ...    over all media
    <medium>.<metric>               radio.frames_collided                                             one medium
    <node>.<signal>.<statistic>     r1.y.last_abs, r*.y.abs_max        `*`, `?` and `[..]` match several nodes
    count.<node>.<counter>          count.r*.slots_missed              summed over nodes
    guarantee.<name>.<figure>       guarantee.fresh.first_violation_s  of a guarantee that the scenario states
    cost.<name>, cost.<name>.<node>     cost.energy.r1                        of a cost that the scenario states
    real_time.<figure>              real_time.lateness_p99_s           lateness of the instants of a run in real time
    late_<figure>                   late_p99_s, late_worst_s           lateness of its deliveries
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from types import MappingProxyType

from experiments.scenario.fate_keys import FATE_OF, FORMER, NOT_DELIVERED, complaint
from netem.core.nearest import nearest as closest

COUNTED = ("frames_offered", *FATE_OF, NOT_DELIVERED, "delivery_ratio")
LEDGER_METRICS = (*COUNTED, "age_of_information_max_s", "age_of_information_mean_s",
                  "max_successive_losses", "inter_transmission_min_s", "inter_transmission_max_s")
SPREAD_LAST = "spread_last"
STATISTICS = ("first", "last", "last_abs", "min", "max", "abs_max", "mean", "rms", SPREAD_LAST)
COUNT = "count"
GUARANTEE = "guarantee"
COST = "cost"
REAL_TIME = "real_time"
LATENESS = MappingProxyType({"lateness_median_s": "median_ns", "lateness_p99_s": "p99_ns",
                             "lateness_worst_s": "worst_ns", "overruns": "overruns"})       # as in run.json
LATE = MappingProxyType({"late_median_s": "median_ns", "late_p99_s": "p99_ns", "late_worst_s": "worst_ns"})
RULE = (f"expected <metric>, <medium>.<metric>, <node>.<signal>.<statistic>, {COUNT}.<node>.<counter>, "
        f"{GUARANTEE}.<name>.<figure> or {REAL_TIME}.<figure>")

Nodes = Mapping[str, Collection[str]] | Collection[str]


class UnknownKeys(ValueError):
    """Keys of `[expect]` that name nothing; the message holds one line for each."""


@dataclass(frozen=True)
class LedgerKey:
    metric: str
    medium: str | None = None


@dataclass(frozen=True)
class SignalKey:
    nodes: str
    signal: str
    statistic: str


@dataclass(frozen=True)
class CountKey:
    nodes: str
    counter: str


@dataclass(frozen=True)
class GuaranteeKey:
    name: str
    figure: str


@dataclass(frozen=True)
class RealTimeKey:
    figure: str


@dataclass(frozen=True)
class CostKey:
    name: str
    node: str = ""              # "": all nodes together


Key = CostKey | LedgerKey | SignalKey | CountKey | GuaranteeKey | RealTimeKey


def guarantee_figures(unit: str) -> tuple[str, ...]:
    """Return the figures of a guarantee whose bound is in `unit`, "s" or ""."""
    suffix = f"_{unit}" if unit else ""
    return ("violations", "first_violation_s", "violated_s", f"worst{suffix}", f"margin{suffix}")


def parse(key: str) -> Key | None:
    """Return the parts of `key`, by its form alone; None if it has no known form."""
    parts = key.split(".")
    if not all(parts) or len(parts) < 2:
        return LedgerKey(key) if key in LEDGER_METRICS else RealTimeKey(key) if key in LATE else None
    if parts[0] == COUNT:
        return CountKey(parts[1], ".".join(parts[2:])) if len(parts) > 2 else None
    if parts[0] == GUARANTEE:
        return GuaranteeKey(parts[1], parts[2]) if len(parts) == 3 else None
    if parts[0] == COST and len(parts) in (2, 3) and parts[-1] not in STATISTICS:
        return CostKey(*parts[1:])
    if parts[0] == REAL_TIME:
        return RealTimeKey(parts[1]) if len(parts) == 2 and parts[1] in LATENESS else None
    if parts[-1] in STATISTICS and len(parts) > 2:
        return SignalKey(parts[0], ".".join(parts[1:-1]), parts[-1])
    return LedgerKey(parts[-1], ".".join(parts[:-1])) if parts[-1] in LEDGER_METRICS else None


def over_a_window(key: str) -> bool:
    """Return whether `key` can be judged over a part of the run, as samples and frame copies can, but not ages."""
    match parse(key):
        case SignalKey():
            return True
        case LedgerKey(metric):
            return metric in COUNTED
    return False


def unknown_keys(expect: Iterable[str], nodes: Nodes, media: Collection[str],
                 guarantees: Mapping[str, Collection[str]] = MappingProxyType({}),
                 costs: Mapping[str, Collection[str]] = MappingProxyType({})) -> list[str]:
    """Return a line for each key that names no figure, with key, rule and nearest valid key.

    Signals are checked if `nodes` maps each node to the names of its signals; `guarantees` maps names to figures,
    `costs` to the nodes that have a part. For counters see `uncounted`.
    """
    lines = (_of_cost(key, costs) if isinstance(parse(key), CostKey) else _complaint(key, nodes, media, guarantees)
             for key in expect)
    return [line for line in lines if line]


def uncounted(key: str, counters: Mapping[str, Collection[str]]) -> str:
    """Return rule, nearest counter and remedy if `key` names a counter that no node has, else "".

    `counters` maps each node to the names of its counters at the end of the run.
    """
    asked = parse(key)
    if not isinstance(asked, CountKey):
        return ""
    known = {name for node in matching(asked.nodes, counters) for name in counters[node]}
    if asked.counter in known or not counters:
        return ""
    near = f"; nearest: {COUNT}.{asked.nodes}.{nearest(asked.counter, known)}" if known else ""
    return (f"no node that matches {asked.nodes!r} has a counter {asked.counter!r}{near}; if its program may count "
            f"nothing, let it declare the counter at its start: board.count({asked.counter!r}, 0)")


def matching(pattern: str, nodes: Iterable[str]) -> list[str]:
    return sorted(node for node in nodes if fnmatchcase(node, pattern))


def nearest(word: str, words: Iterable[str]) -> str:
    """Return the word most similar to `word`, "" if there are no words."""
    return closest(word, sorted(set(words)), 0.0) or ""


def _complaint(key: str, nodes: Nodes, media: Collection[str],
               guarantees: Mapping[str, Collection[str]]) -> str | None:
    match parse(key):
        case None if former := complaint(key.rpartition(".")[2]):
            return f"expect.{key}: {former}"
        case None:
            found = nearest(key, _candidates(key, nodes, media, guarantees))
            before, dot, metric = found.rpartition(".")
            return f"expect.{key}: {RULE}; nearest: {before}{dot}{FORMER.get(metric, metric)}"
        case GuaranteeKey(name, figure) if not guarantees:
            return f"expect.{key}: there is no guarantee {name!r}, nor any other; add [guarantees.{name}] with its kind"
        case GuaranteeKey(name, figure) if name not in guarantees:
            return (f"expect.{key}: there is no guarantee {name!r}; nearest: "
                    f"{GUARANTEE}.{nearest(name, guarantees)}.{figure}")
        case GuaranteeKey(name, figure) if figure not in guarantees[name]:
            return (f"expect.{key}: guarantees.{name} has the figures {', '.join(guarantees[name])}; nearest: "
                    f"{GUARANTEE}.{name}.{nearest(figure, guarantees[name])}")
        case LedgerKey(metric, medium) if medium is not None and not media:
            return f"expect.{key}: there is no medium {medium!r}, nor any other; add [media.{medium}] with its kind"
        case LedgerKey(metric, medium) if medium is not None and medium not in media:
            return f"expect.{key}: there is no medium {medium!r}; nearest: {nearest(medium, media)}.{metric}"
        case SignalKey(pattern) | CountKey(pattern) if not matching(pattern, nodes):
            near = f"; nearest: {key.replace(pattern, nearest(pattern, nodes), 1)}" if nodes else ""
            return f"expect.{key}: no node matches {pattern!r}{near}"
        case SignalKey(pattern, signal, statistic) if isinstance(nodes, Mapping):
            known = {name for node in matching(pattern, nodes) for name in nodes[node]}
            if signal not in known:
                near = f"nearest: {pattern}.{nearest(signal, known)}.{statistic}" if known else "it records none"
                return f"expect.{key}: no node that matches {pattern!r} has a signal {signal!r}; {near}"
    return None


def _of_cost(key: str, costs: Mapping[str, Collection[str]]) -> str | None:
    match parse(key):
        case CostKey() if not costs:
            return f"expect.{key}: there is no cost in this scenario; add [costs.NAME] with its kind"
        case CostKey(name) if name not in costs:
            return f"expect.{key}: there is no cost {name!r}; nearest: {COST}.{nearest(name, costs)}"
        case CostKey(name, node) if node and node not in costs[name]:
            near = f"nearest: {COST}.{name}.{nearest(node, costs[name])}" if costs[name] else f"write {COST}.{name}"
            return f"expect.{key}: costs.{name} has no part for {node!r}; {near}"
    return None


def _candidates(key: str, nodes: Nodes, media: Collection[str],
                guarantees: Mapping[str, Collection[str]]) -> list[str]:
    first, _, rest = key.partition(".")
    special = closest(first, (COUNT, GUARANTEE, REAL_TIME), 0.8)
    if special == COUNT:
        node, _, counter = rest.partition(".")
        return [f"{COUNT}.{name}.{counter or '<counter>'}" for name in matching(node, nodes) or nodes]
    if special == GUARANTEE:
        return [f"{GUARANTEE}.{name}.{figure}" for name, figures in guarantees.items() for figure in figures]
    if special == REAL_TIME:
        return [f"{REAL_TIME}.{figure}" for figure in LATENESS]
    if not rest:
        return [*LEDGER_METRICS, *FORMER, *LATE]
    found = [f"{medium}.{metric}" for medium in media for metric in (*LEDGER_METRICS, *FORMER)]
    matched = matching(first, nodes)
    for node in matched or nodes:
        signals = nodes[node] if isinstance(nodes, Mapping) else [rest.rpartition(".")[0] or rest]
        shown = first if matched else node
        found += [f"{shown}.{signal}.{statistic}" for signal in signals for statistic in STATISTICS]
    return found
