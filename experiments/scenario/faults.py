"""Reads `[[faults]]`: what occurs, to whom, and when."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from experiments.programs.firmware_programs import class_for
from experiments.scenario.agents import Agents
from experiments.scenario.model import AgentSpec, FaultSpec, MediumSpec, Scenario, positions
from experiments.scenario.plant_parameters import PlantNames, plant_names
from experiments.scenario.problems import Place, near, path_text
from experiments.scenario.refusals import refuse
from experiments.scenario.sections import Reading
from experiments.scenario.shape import shape_of
from netem.core.link_name import LinkName
from netem.core.random_streams import stream
from netem.faults import Fault, Site
from netem.faults.schedule import Occurrence, Schedule, windows_of
from netem.faults.table import FAULTS
from netem.wire.instants import NEVER_NS


@dataclass(frozen=True)
class FaultHeader:
    on: str
    name: str = ""
    at_ns: int | None = None
    during_ns: tuple[Any, ...] = ()
    lasts_ns: int | None = None
    every_ns: int | None = None
    times: int | None = None
    rate_per_s: float | None = None


def read_faults(tables: Sequence[Any], reader: Agents, agents: Mapping[str, AgentSpec],
                media: Mapping[str, MediumSpec], seed: int, length_ns: int, reading: Reading) -> tuple[FaultSpec, ...]:
    """Return the faults with their targets and their occurrences in a run of this seed and length."""
    site = site_of(agents, media, reader.plants,
                   {name for cls, own in reader.programs.items() if has_execution_time(cls) for name in own})
    found = []
    names: dict[str, Place] = {}
    for index, table in enumerate(tables):
        place: Place = ("faults", index)
        spec = read_fault(table, place, site, media, seed, length_ns, reading)
        if spec is not None:
            if spec.name in names:
                reading.problems.add((*place, "name"), f"the name of {path_text(names[spec.name])} too, so both would "
                                     "draw the same; give each a name of its own", spec.name)
            if spec.name:
                names.setdefault(spec.name, place)
            found.append(spec)
    refuse_overlaps(found, reading)
    return tuple(found)


def site_of(agents: Mapping[str, AgentSpec], media: Mapping[str, MediumSpec], plants: Mapping[str, PlantNames],
            timed: Collection[str]) -> Site:
    """Return the names that faults can be about; `timed` has the agents whose programs have execution times."""
    known = {name: medium.settings for name, medium in media.items() if medium.settings is not None}
    return Site(tuple(agents), {name: medium.nodes for name, medium in media.items()},
                {name: settings.links_to_themselves() for name, settings in known.items()}, plants, timed,
                {name: settings.strikable for name, settings in known.items()},
                {name: settings.located(positions(media[name].nodes, agents)) for name, settings in known.items()})


def site_for_search(scenario: Scenario, links: Collection[LinkName]) -> Site:
    """Return what a search can draw faults for in a scenario; `links` are those that carry frames."""
    plants = {name: plant_names(agent.plant.fmu, scenario.folder) for name, agent in scenario.agents.items()
              if agent.plant is not None}
    timed = {name for name, agent in scenario.agents.items()
             if has_execution_time(class_for(agent.program, scenario.folder))}
    return site_of(scenario.agents, scenario.media, plants, timed)._replace(links=links)


def has_execution_time(program: Any) -> bool:
    """Return whether a program class says that its tasks take time, by `Board.execution_ns`."""
    return getattr(program, "has_execution_time", False) is True


def read_fault(table: Any, place: Place, site: Site, media: Mapping[str, MediumSpec], seed: int, length_ns: int,
               reading: Reading) -> FaultSpec | None:
    """Return the fault of one table; None, with the problems added, for one that is wrong."""
    problems = reading.problems
    if not isinstance(table, dict):
        problems.add(place, "expected a table", table)
        return None
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in FAULTS:
        given = (kind,) if "kind" in table else ()
        problems.add((*place, "kind"), f"{'no such kind' if given else 'is missing'}; {near(kind or '', FAULTS)}",
                     *given)
        return None
    common, cls = shape_of(FaultHeader), FAULTS[kind]
    header, complete, _ = reading.tables.read(
        common, {key: value for key, value in table.items() if key in common.field_of}, place,
        ["kind", *shape_of(cls).keys()])
    own = {key: value for key, value in table.items() if key not in common.field_of and key != "kind"}
    fault: Fault | None = reading.tables.read(shape_of(cls), own, place, ["kind", *common.keys()], cls).made
    if header.get("name"):
        reading.check_name((*place, "name"), header["name"])
    targets: list[tuple[str, ...]] = []
    if fault is not None and "on" in header:
        try:
            targets = fault.resolve(header["on"], site)
            if why := next(filter(None, (fault.refusal(target, site) or _misplaced(kind, fault, target, media)
                                         for target in targets)), ""):
                raise ValueError(why)
        except ValueError as error:
            refuse(error, table, place, problems) if "=" in str(error).partition(":")[0] else \
                problems.add((*place, "on"), str(error), header["on"])
    called = header.get("name") or path_text(place)
    occurrences: list[Occurrence] = []
    during_ns = windows_of(header.get("during_ns", ()))
    if during_ns is None:
        problems.add((*place, "during_s"), "expected [start, end], or a list of such windows")
    elif fault is not None and complete:
        try:
            timing = {key: value for key, value in header.items() if key not in ("on", "name", "during_ns")}
            occurrences = Schedule(during_ns=during_ns, **timing).occurrences(
                length_ns, stream(seed, f"{called}/times"), lasting=fault.lasting)
        except ValueError as error:
            refuse(error, table, place, problems)
    if fault is None or not targets:
        return None
    return FaultSpec(path_text(place), header.get("name", ""), kind, header["on"], tuple(targets), fault,
                     tuple(occurrences), "rate_per_s" in header)


def _misplaced(kind: str, fault: Fault, target: Sequence[str], media: Mapping[str, MediumSpec]) -> str:
    """Return why a medium does not take faults of this kind, "" if it does or the fault is none of a medium."""
    if fault.on == "nodes" or (settings := media[target[0]].settings) is None or fault.strikes in settings.strikable:
        return ""
    taken = [name for name, cls in FAULTS.items() if cls.on != "nodes" and cls.strikes in settings.strikable]
    return (f"{target[0]} is a medium of kind {media[target[0]].kind}, which takes no fault of kind {kind}: it takes "
            f"{', '.join(taken)}")


def refuse_overlaps(faults: Sequence[FaultSpec], reading: Reading) -> None:
    """Refuse faults at planned times that take a node away while another does so already."""
    gone: dict[str, list[tuple[int, int, FaultSpec]]] = {}
    for spec in faults:
        if not spec.settings.away or spec.at_random:
            continue
        for occurrence in spec.occurrences:
            start_ns, end_ns = occurrence[0], spec.settings.until_ns(Occurrence(*occurrence))
            for node, *_ in spec.targets:
                for other_start_ns, other_end_ns, other in gone.setdefault(node, []):
                    if start_ns < other_end_ns and other_start_ns < end_ns:
                        until = "for ever" if other_end_ns >= NEVER_NS else f"until {other_end_ns / 1e9:.9g} s"
                        reading.problems.say(
                            f"{spec.place}: {spec.kind} of {node} at {start_ns / 1e9:.9g} s: {other.called} "
                            f"({other.kind}) takes it away from {other_start_ns / 1e9:.9g} s {until}; let one end "
                            "before the next begins")
                        break
                gone[node].append((start_ns, end_ns, spec))
