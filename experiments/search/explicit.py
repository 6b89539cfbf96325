"""Writes what happened in a run out as entries of a scenario: each fault, loss, delay and flipped bit, one by one.

    faults at random, repeated, of several nodes      one entry for each occurrence, and for each node
    impairments that draw, or are scripts             what they did to each frame in this run, by link and number
    all other impairments                             as they are: they do the same wherever they stand

Not modelled: the draws of the fault `noise` of a sensor, which are others.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from experiments.run.network import is_written_out
from experiments.scenario.model import FaultSpec, Scenario
from experiments.scenario.units import spellings
from experiments.search.base import Tables, on_text
from netem.core.link_name import LinkName
from netem.faults.schedule import Occurrence
from netem.impairments.changes import Change, changes_of
from netem.impairments.traced import Watched
from netem.wire.instants import NEVER_NS

TIMING = frozenset(("times", "rate_per_s", *(key for field in ("at_ns", "during_ns", "lasts_ns", "every_ns")
                                             for key in spellings(field))))
FIRST = -1                              # place of what faults do to frames: before all impairments


@dataclass(frozen=True)
class Item:
    """What can be left out: a fault, or what impairment `place` does to frame `number` of `link`, or does at all.

    `source` is the entry of the scenario that it comes from; `copy` is None on a link without duplicates.
    """

    at_ns: int
    source: str
    fault: int = -1                     # place in `Explicit.faults`
    place: int = FIRST                  # in `[[impairments]]`
    link: LinkName | None = None
    number: int = -1
    copy: int | None = None
    change: Change | None = None


class Explicit:
    """A run of `scenario`, whose tables are `tables`, in explicit entries; `watched` is the trace of that run."""

    def __init__(self, scenario: Scenario, tables: Tables, watched: Sequence[Watched] = ()) -> None:
        self.impairments: list[Any] = list(tables.get("impairments", []))
        self.faults: list[Tables] = []
        items = [Item(0, spec.place, place=place) for place, spec in enumerate(scenario.impairments)
                 if not is_written_out(scenario, spec)]
        sources = {spec.cause: (spec.place, place) for place, spec in enumerate(scenario.impairments)}
        sources |= {spec.cause: (spec.place, FIRST) for spec in scenario.faults}
        for one in watched:
            source, place = sources[one.cause]
            items += [Item(effect.sent_ns, source, place=place, link=one.link, number=effect.number,
                           copy=effect.copy if one.copies else None, change=change)
                      for effect in one.effects for change in changes_of(effect)]
        traced = {one.cause for one in watched}
        for at_ns, spec, table in _explicit_faults(scenario.faults, tables.get("faults", [])):
            if spec.cause not in traced:
                items.append(Item(at_ns, spec.place, fault=len(self.faults)))
                self.faults.append(table)
        self.items = tuple(sorted(items, key=lambda item: item.at_ns))

    def entries(self, items: Collection[Item]) -> Tables:
        """Return `impairments` and `faults` with these items only."""
        scripts: dict[tuple[int, LinkName, int, type[Change]], dict[int, Change]] = {}
        whole = set()
        for item in items:
            if item.link is not None and item.change is not None:
                copy = -1 if item.copy is None else item.copy
                scripts.setdefault((item.place, item.link, copy, type(item.change)), {})[item.number] = item.change
            elif item.fault < 0:
                whole.add(item.place)
        listed = [(place, self.impairments[place]) for place in whole]
        listed += [(place, cls.entry(on_text(link), frames, None if copy < 0 else copy))
                   for (place, link, copy, cls), frames in sorted(scripts.items(), key=_in_order)]
        return {"impairments": [table for _, table in sorted(listed, key=lambda entry: entry[0])],
                "faults": [self.faults[place] for place in sorted(item.fault for item in items if item.fault >= 0)]}

    def in_words(self, items: Sequence[Item]) -> Iterator[str]:
        for item in items:
            if item.fault >= 0:
                table = self.faults[item.fault]
                yield f"{table['kind']} of {table['on']} at {item.at_ns / 1e9:.9g} s"
            elif item.link is not None and item.change is not None:
                copy = f", copy {item.copy}," if item.copy else ""
                yield (f"{on_text(item.link)}: frame {item.number}{copy} {item.change.in_words()}, at "
                       f"{item.at_ns / 1e9:.9g} s")
            else:
                table = self.impairments[item.place]
                yield f"{table['kind']} on {table['on']}"


def _in_order(entry: tuple[tuple[int, LinkName, int, type[Change]], Any]) -> tuple[int, LinkName, int, int]:
    place, link, copy, cls = entry[0]
    return place, link, cls.rank, copy


def _explicit_faults(faults: Sequence[FaultSpec], tables: Sequence[Any]) -> list[tuple[int, FaultSpec, Tables]]:
    """Return the instant, the fault and the table of each occurrence, for each node of it, in order of time.

    An occurrence that found its node away already is left out: it had no effect.
    """
    found: list[tuple[int, str, int, FaultSpec, Tables]] = []       # start, node that is away and its return
    for spec, table in zip(faults, tables, strict=True):
        fault = spec.settings
        own = {key: value for key, value in table.items() if key not in TIMING and key != "name"}
        nodes = [node for node, *_ in spec.targets] if fault.on == "nodes" else [""]
        for start_ns, end_ns in spec.occurrences:
            until_ns = fault.until_ns(Occurrence(start_ns, end_ns))
            times: Tables = {"at_s": start_ns / 1e9} if not fault.lasting or end_ns >= NEVER_NS else {
                "during_s": [start_ns / 1e9, end_ns / 1e9]}
            found += [(start_ns, node if fault.away else "", until_ns, spec,
                       own | ({"on": node} if node else {}) | times) for node in nodes]
    back_ns: dict[str, int] = {}
    kept = []
    for start_ns, node, until_ns, spec, table in sorted(found, key=lambda entry: entry[0]):
        if node and start_ns < back_ns.get(node, 0):
            continue
        if node:
            back_ns[node] = until_ns
        kept.append((start_ns, spec, table))
    return kept
