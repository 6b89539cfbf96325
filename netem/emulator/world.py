"""Faults in a run: the world that they change, and their occurrences as events of the run.

    fault.strike --at--> conductor: a stop, at which nodes are killed, stand still or get a fault of their own
                 --cut, flip--> links: impairments of the fault, first and last on the way of a copy
                 --on_medium--> a medium, which fails in a way of its own
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from random import Random
from typing import Any

from netem.core.agenda import Agenda
from netem.core.link_name import LinkName
from netem.core.windows import Windows
from netem.emulator.conductor import Conductor
from netem.faults import Fault, Target
from netem.faults.schedule import Occurrence
from netem.impairments import Impairment
from netem.impairments.cut import Entrance, Exit
from netem.impairments.traced import Trace
from netem.impairments.undetected_flips import UndetectedFlips
from netem.impairments.within import Within
from netem.media.links import Links
from netem.records.events import Event
from netem.wire.instants import NEVER_NS
from netem.wire.level import Level

FAULT = -1          # priority in the agenda: before all else at an instant


class RunWorld:
    """Carries out what faults tell. `rng_for` returns the random stream of a place; `trace` watches what is drawn."""

    def __init__(self, conductor: Conductor, agenda: Agenda, links: Links, rng_for: Callable[[str], Random],
                 trace: Trace | None = None) -> None:
        self._conductor, self._agenda, self._links, self._rng_for = conductor, agenda, links, rng_for
        self._trace = trace
        self._windows: dict[tuple[LinkName, str], Windows] = {}
        self._entrances: dict[LinkName, int] = {}

    def occurs(self, fault: Fault, cause: str, targets: Sequence[Target], occurrence: Occurrence) -> None:
        """Let one occurrence of the fault happen; it is an event at its start and, if it has one, at its end."""
        for subject, detail in _in_words(targets).items():
            until_ns = fault.until_ns(occurrence)
            self._event(occurrence.start_ns, subject, "fault", f"{cause}{detail}", Level.WARNING)
            if occurrence.start_ns < until_ns < NEVER_NS:
                self._event(until_ns, subject, "fault over", f"{cause}{detail}", Level.INFO)
        fault.strike(self, cause, targets, occurrence)

    def at(self, time_ns: int, action: Callable[[], None]) -> None:
        if time_ns < self._conductor.end_ns:
            self._conductor.stop_at(time_ns, action)

    def kill(self, node: str, boots_ns: int, fields: Mapping[str, Any], cause: str) -> None:
        if not self._conductor.kill(node, boots_ns, fields, cause):
            self._without_effect(node, "it is dead already")

    def pause(self, node: str, until_ns: int, depth: int, cause: str) -> None:
        if not self._conductor.pause(node, until_ns, depth, cause):
            self._without_effect(node, "it is dead or stands still already")

    def in_node(self, node: str, kind: str, fields: Mapping[str, Any]) -> None:
        self._conductor.fault(node, kind, fields)

    def on_medium(self, target: Target, how: str, cause: str, fields: Mapping[str, Any],
                  occurrence: Occurrence) -> None:
        name, *of = target
        why = self._conductor.media[name].take_fault(
            how, cause, of, fields, occurrence.start_ns, min(occurrence.end_ns, self._conductor.end_ns))
        if why:
            self._tell(Event(max(occurrence.start_ns, self._conductor.stop_ns), name, "fault without effect",
                             f"{' -> '.join(of)}: {why}" if of else why, Level.INFO))

    def cut(self, link: LinkName, cause: str, spares_under_way: bool) -> Windows:
        windows = self._windows.get((link, cause))
        if windows is None:
            windows = self._windows[link, cause] = Windows()
            pipeline = self._links.pipeline(link)
            place = self._entrances.get(link, 0)
            self._entrances[link] = place + 1
            pipeline.insert(place, (cause, Entrance(windows, self._now_ns if spares_under_way else None)))
            if not spares_under_way:
                pipeline.append((cause, Exit(windows)))
        return windows

    def flip(self, link: LinkName, cause: str, ratio: float, flipped_bits: int, spares_under_way: bool) -> Windows:
        windows = self._windows.get((link, cause))
        if windows is None:
            windows = self._windows[link, cause] = Windows()
            medium, sender, receiver = link
            rng = self._rng_for(f"{cause}/{medium}: {sender} -> {receiver}")
            place = self._entrances.get(link, 0)
            self._entrances[link] = place + 1
            flips: Impairment = Within(UndetectedFlips(ratio, flipped_bits, rng), windows,
                                       self._now_ns if spares_under_way else None)
            if self._trace is not None:
                flips = self._trace.watch(cause, link, flips)
            self._links.pipeline(link).insert(place, (cause, flips))
        return windows

    def _now_ns(self) -> int:
        return self._agenda.now_ns

    def _event(self, time_ns: int, subject: str, kind: str, detail: str, level: Level) -> None:
        self._agenda.at(time_ns, FAULT, subject, partial(
            self._tell, Event(time_ns, subject, kind, detail, level)))

    def _tell(self, event: Event) -> None:
        if event.time_ns < self._conductor.end_ns:
            self._conductor.recorders.event(event)

    def _without_effect(self, node: str, why: str) -> None:
        self._tell(Event(self._conductor.stop_ns, node, "fault without effect", why, Level.INFO))


def _in_words(targets: Sequence[Target]) -> dict[str, str]:
    """Return what the event of a fault says of its targets, by the node or medium that it belongs to."""
    links: dict[str, list[str]] = {}
    for first, *rest in targets:
        links.setdefault(first, []).extend([" -> ".join(rest)] if rest else [])
    return {name: f" {'; '.join(found)}" if 0 < len(found) <= 3 else f" {len(found)} links" if found else ""
            for name, found in links.items()}
