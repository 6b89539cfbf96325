"""Writes the faults and losses of a run out as entries of a scenario: each occurrence, each lost frame, one by one.

    faults at random, repeated, of several nodes      one entry for each occurrence, and for each node
    impairments that only lose frames                 the frames that they lost in this run, by link and number
    all other impairments                             as they are; what they lose as well stays drawn

A random stream is named by the place of its impairment in the list. An entry that is left out is therefore replaced by
one without effect as long as others follow, so that these draw what they drew.
Not modelled: the draws of a fault that draws while it acts, as `undetected_corruption` does, are others.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.scenario.model import FaultSpec, Scenario
from experiments.scenario.units import spellings
from experiments.search.base import Tables, on_text, pure_losses
from experiments.search.link_frames import link_frames
from netem.core.link_name import LinkName
from netem.faults.schedule import Occurrence
from netem.impairments.entries import losing, without_effect
from netem.wire.instants import NEVER_NS

TIMING = frozenset(("times", "rate_per_s", *(key for field in ("at_ns", "during_ns", "lasts_ns", "every_ns")
                                             for key in spellings(field))))


@dataclass(frozen=True)
class Item:
    """What can be left out: a fault at an instant, frame `number` lost on `link`, or impairment `place`."""

    at_ns: int
    fault: int = -1                     # place in `Explicit.faults`
    link: LinkName | None = None
    number: int = -1
    place: int = -1                     # in `[[impairments]]`


class Explicit:
    """The run in `folder` of `scenario`, whose tables are `tables`, in explicit entries.

    Raises OSError or ArrowException if the run left no ledger.
    """

    def __init__(self, folder: Path, scenario: Scenario, tables: Tables) -> None:
        self.impairments: list[Any] = list(tables.get("impairments", []))
        self.faults: list[Tables] = []
        lossy = dict(pure_losses(scenario))
        causes = {f"{spec.called} {spec.kind}" for spec in lossy.values()}
        items = [Item(0, place=place) for place in range(len(self.impairments)) if place not in lossy]
        for at_ns, table in _explicit_faults(scenario.faults, tables.get("faults", [])):
            items.append(Item(at_ns, fault=len(self.faults)))
            self.faults.append(table)
        for link, frames in link_frames(folder, scenario).items():
            items += [Item(frame.end_ns, link=link, number=number) for number, frame in enumerate(frames)
                      if frame.lost and frame.cause in causes]
        self.items = tuple(sorted(items, key=lambda item: item.at_ns))

    def entries(self, items: Collection[Item], *, same_draws: bool = True) -> Tables:
        """Return `impairments` and `faults` with these items only.

        With `same_draws`, impairments that are left out keep their places, with entries that do nothing.
        """
        stay = {item.place for item in items if item.place >= 0}
        last = max(stay, default=-1)
        kept = [table if place in stay else without_effect(table["on"])
                for place, table in enumerate(self.impairments) if place in stay or (same_draws and place < last)]
        lost: dict[LinkName, list[int]] = {}
        for item in items:
            if item.link is not None:
                lost.setdefault(item.link, []).append(item.number)
        return {"impairments": kept + [losing(on_text(link), sorted(numbers))
                                       for link, numbers in sorted(lost.items())],
                "faults": [self.faults[place] for place in sorted(item.fault for item in items if item.fault >= 0)]}

    def in_words(self, items: Sequence[Item]) -> Iterator[str]:
        for item in items:
            if item.fault >= 0:
                table = self.faults[item.fault]
                yield f"{table['kind']} of {table['on']} at {item.at_ns / 1e9:.9g} s"
            elif item.link is not None:
                yield f"{on_text(item.link)}: frame {item.number} is lost, at {item.at_ns / 1e9:.9g} s"
            else:
                table = self.impairments[item.place]
                yield f"{table['kind']} on {table['on']}"


def _explicit_faults(faults: Sequence[FaultSpec], tables: Sequence[Any]) -> list[tuple[int, Tables]]:
    """Return the instant and the table of each occurrence, for each node of it, in order of time.

    An occurrence that found its node away already is left out: it had no effect.
    """
    found: list[tuple[int, str, int, Tables]] = []          # start, node that is away and its return, table
    for spec, table in zip(faults, tables, strict=True):
        fault = spec.settings
        own = {key: value for key, value in table.items() if key not in TIMING and key != "name"}
        nodes = [node for node, *_ in spec.targets] if fault.on == "nodes" else [""]
        for start_ns, end_ns in spec.occurrences:
            until_ns = fault.until_ns(Occurrence(start_ns, end_ns))
            times: Tables = {"at_s": start_ns / 1e9} if not fault.lasting or end_ns >= NEVER_NS else {
                "during_s": [start_ns / 1e9, end_ns / 1e9]}
            found += [(start_ns, node if fault.away else "", until_ns, own | ({"on": node} if node else {}) | times)
                      for node in nodes]
    back_ns: dict[str, int] = {}
    kept = []
    for start_ns, node, until_ns, table in sorted(found, key=lambda entry: entry[0]):
        if node and start_ns < back_ns.get(node, 0):
            continue
        if node:
            back_ns[node] = until_ns
        kept.append((start_ns, table))
    return kept
