"""A scenario file into a `Scenario`, or into every mistake in it at once.

    file --TOML, overrides--> tables --names, units, types--> header, agents, media, impairments, expect
                                     --each class's own rules, links, programs--> Scenario --check of its programs-->
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Annotated, Any, Final

from pydantic import Field

from experiments.scenario import overrides as overriding
from experiments.scenario.document import check_values, question_of, read
from experiments.scenario.fill import construct, fill
from experiments.scenario.model import AgentSpec, Bound, ImpairmentSpec, Link, MediumSpec, PlantSpec, Scenario, Window
from experiments.scenario.plant_parameters import base
from experiments.scenario.problems import Place, Problems, near, path_text
from experiments.scenario.program import check_program
from experiments.scenario.refusals import refuse
from experiments.scenario.shape import Shape, shape_of
from experiments.scenario.units import siblings, spellings
from experiments.scenario.vocabulary import Vocabulary
from firmware_sim.local_clock import ClockSettings

SECTIONS: Final = ("team", "agents", "agents_defaults", "media", "impairments", "expect")
NAME_RULE: Final = "a name has letters, digits, - and _, and starts with a letter"


@dataclass(frozen=True)
class Header:
    """The single values at the top of the file."""

    seed: Annotated[int, Field(ge=0)]
    length_ns: Annotated[int, Field(gt=0)]
    sample_period_ns: Annotated[int, Field(ge=0)] = 10_000_000      # 0: no samples
    node_timeout_s: Annotated[float, Field(gt=0)] = 30.0            # wall clock: stays in seconds


@dataclass(frozen=True)
class PlantTable:
    fmu: str
    parameters: dict[str, Any] = field(default_factory=dict)
    parameters_from: str | None = None


@dataclass(frozen=True)
class AgentTable:
    program: str
    parameters: dict[str, Any] = field(default_factory=dict)
    clock: ClockSettings = field(default_factory=ClockSettings)
    plant: PlantTable | None = None
    at_m: tuple[float, ...] | None = None
    media: tuple[str, ...] | None = None


@dataclass(frozen=True)
class ImpairmentHeader:
    on: str
    during_ns: tuple[Any, ...] = ()


def load(source: Path, *, seed: int | None = None, duration_s: float | None = None, overrides: Sequence[str] = (),
         vocabulary: Vocabulary | None = None) -> Scenario:
    """The scenario in the file `source`; `seed`, `duration_s` and `overrides` replace what it says.

    ScenarioError holds every problem found.
    """
    document, text = read(source)
    problems = Problems(source.name)
    top_level = [*shape_of(Header).keys(), *SECTIONS]
    overriding.apply(document, overrides, top_level, problems)
    if seed is not None:
        document["seed"] = seed
    if duration_s is not None:
        for other in siblings("length_s"):
            document.pop(other, None)
        document["length_s"] = duration_s
    check_values(document, problems)
    problems.stop_if_any()
    if vocabulary is None:
        from experiments.scenario.house import house_vocabulary
        vocabulary = house_vocabulary()
    scenario, programs = _Reader(document, source.absolute(), problems, vocabulary).scenario(question_of(text))
    _ask_programs(scenario, programs, problems)
    problems.stop_if_any()
    return scenario


class _Reader:
    """Reads section by section, so that a mistake in one hides none in another."""

    def __init__(self, document: dict[str, Any], path: Path, problems: Problems, vocabulary: Vocabulary) -> None:
        self.document = document
        self.path = path
        self.folder = path.parent
        self.problems = problems
        self.vocabulary = vocabulary
        self.programs: dict[type, str] = {}

    def scenario(self, question: str) -> tuple[Scenario, dict[type, str]]:
        tables = {key: self._section(key) for key in SECTIONS if key != "impairments"}
        own = {key: value for key, value in self.document.items() if key not in SECTIONS}
        header = construct(Header, own, (), self.problems, self.folder, besides=SECTIONS)
        self.problems.written_at = self._written_at
        agents = self._agents(tables["agents"], tables["agents_defaults"], list(tables["media"]))
        media = self._media(tables["media"], agents)
        impairments = self._impairments(media)
        expect = self._expect(tables["expect"], agents, media)
        self.problems.stop_if_any()
        return Scenario(self.path.stem, str(self.path), question, header.seed, header.length_ns,
                        header.sample_period_ns, header.node_timeout_s, tables["team"], agents, media, impairments,
                        expect), self.programs

    def _section(self, key: str) -> dict[str, Any]:
        table = self.document.get(key, {})
        if isinstance(table, dict):
            return table
        self.problems.add((key,), "expected a table", table)
        return {}

    def _written_at(self, place: Place) -> Place:
        """What an agent has from `agents_defaults` was written there."""
        if len(place) < 3 or place[0] != "agents":
            return place
        if not _holds(self.document["agents"], place[1:]) and _holds(self.document.get("agents_defaults"), place[2:]):
            return ("agents_defaults", *place[2:])
        return place

    # --- agents

    def _agents(self, tables: Mapping[str, Any], defaults: dict[str, Any], media: list[str]) -> dict[str, AgentSpec]:
        if not tables and not self.problems.has(("agents",)):
            self.problems.add(("agents",), "a scenario has at least one agent; add [agents.NAME] with its program")
        return {name: self._agent(name, _merged(defaults, table) if isinstance(table, dict) else table, media)
                for name, table in tables.items()}

    def _agent(self, name: str, merged: Any, media: list[str]) -> AgentSpec:
        """With mistakes in it, what is left of the agent: others may refer to it."""
        place = ("agents", name)
        self._check_name(place, name)
        values = fill(shape_of(AgentTable), merged, place, self.problems, self.folder).values
        table = AgentTable(**{"program": "", **values})
        parameters = self._program(table.program, table.parameters, place) if table.program else {}
        plant = None if table.plant is None else self._plant(table.plant, (*place, "plant"))
        attached = media if table.media is None else table.media
        for index, medium in enumerate(attached):
            if medium not in media:
                self.problems.add((*place, "media", index), f"no such medium; {near(medium, media)}", medium)
                attached = media
        if table.at_m is not None and len(table.at_m) not in (2, 3):
            self.problems.add((*place, "at_m"), "expected [x, y] or [x, y, z]", list(table.at_m))
        return AgentSpec(name, table.program, parameters, table.clock, plant, table.at_m, tuple(attached))

    def _program(self, program: str, parameters: Any, place: Place) -> dict[str, Any]:
        cls, keywords = check_program(program, parameters, place, self.problems, self.folder)
        if cls is not None:
            self.programs.setdefault(cls, program)
        return keywords

    def _plant(self, table: PlantTable, place: Place) -> PlantSpec | None:
        try:
            plant = self.vocabulary.plant_names(table.fmu, self.folder)
        except ValueError as error:
            self.problems.add((*place, "fmu"), str(error), table.fmu)
            return None
        start: dict[str, Any] = {}
        if table.parameters_from is not None:
            found, complaint = self._lookup(table.parameters_from)
            start = plant.taken_from(found)
            if found and not start:
                known = dict.fromkeys(map(base, plant.parameters))
                complaint = f"no key of that table is a parameter of {table.fmu}; {near('', known)}"
            if complaint:
                self.problems.add((*place, "parameters_from"), complaint, table.parameters_from)
            for key, value in start.items():
                if complaint := plant.complaint(key, value):
                    self.problems.add((*overriding.parse_path(table.parameters_from)[0], key), complaint, value)
        for key, value in table.parameters.items():
            if complaint := plant.complaint(key, value):
                self.problems.add((*place, "parameters", key), complaint, value)
        return PlantSpec(plant.fmu, {**start, **table.parameters})

    def _lookup(self, dotted: str) -> tuple[dict[str, Any], str]:
        """The table of this file at a path and what is wrong with the path."""
        path, rest = overriding.parse_path(dotted)
        if not path or rest:
            return {}, "expected the path of a table, as in team.models.r1"
        here: Any = self.document
        for depth, part in enumerate(path):
            if not _holds(here, (part,)):
                where = path_text(path[:depth]) or "this file"
                return {}, f"{where} has no {part!r}; {near(part, here if isinstance(here, dict) else ())}"
            here = here[part]
        return (here, "") if isinstance(here, dict) else ({}, "is no table")

    # --- media, impairments, expectations

    def _media(self, tables: Mapping[str, Any], agents: Mapping[str, AgentSpec]) -> dict[str, MediumSpec]:
        media: dict[str, MediumSpec] = {}
        for name, table in tables.items():
            place = ("media", name)
            self._check_name(place, name)
            nodes = tuple(agent.name for agent in agents.values() if name in agent.media)
            cls = self._kind(table, place, self.vocabulary.media)
            if cls is None:
                media[name] = MediumSpec(name, "", None, nodes)
                continue
            rest = {key: value for key, value in table.items() if key != "kind"}
            settings = construct(cls.Settings, rest, place, self.problems, self.folder, besides=["kind"])
            if settings is not None and nodes:
                try:
                    self.vocabulary.try_medium(cls, name, settings, {node: agents[node].at_m for node in nodes})
                except ValueError as error:
                    refuse(error, rest, place, self.problems)
            media[name] = MediumSpec(name, table["kind"], settings, nodes)
        return media

    def _impairments(self, media: Mapping[str, MediumSpec]) -> tuple[ImpairmentSpec, ...]:
        tables = self.document.get("impairments", [])
        if not isinstance(tables, list):
            self.problems.add(("impairments",), "expected a list: write [[impairments]]", tables)
            return ()
        return tuple(self._impairment(table, ("impairments", index), media) for index, table in enumerate(tables))

    def _impairment(self, table: Any, place: Place, media: Mapping[str, MediumSpec]) -> ImpairmentSpec:
        cls = self._kind(table, place, self.vocabulary.impairments)
        if not isinstance(table, dict):
            return ImpairmentSpec(path_text(place), "", (), (), "", {})
        common = shape_of(ImpairmentHeader)
        header = {key: value for key, value in table.items() if key in common.keys()}       # noqa: SIM118
        besides = shape_of(cls).keys() if cls is not None else []
        values = fill(common, header, place, self.problems, self.folder, besides).values
        windows = self._windows(values["during_ns"], table, place) if "during_ns" in values else ()
        fields: dict[str, Any] = {}
        if cls is not None:
            own = {key: value for key, value in table.items() if key not in [*header, "kind"]}
            filled = fill(shape_of(cls), own, place, self.problems, self.folder, [*common.keys(), "kind"])
            fields = filled.values
            if filled.complete:
                self._try(cls, fields, windows, table, place)
        links = self._links(values.get("on"), place, media)
        return ImpairmentSpec(path_text(place), values.get("on", ""), links, windows, str(table.get("kind")), fields)

    def _try(self, cls: Any, fields: Mapping[str, Any], windows: Sequence[Window], table: Any, place: Place) -> None:
        """Construct the impairment, so that what it refuses is said before the run."""
        try:
            impairment = cls(**fields, **({"rng": Random(0)} if "rng" in cls.__dataclass_fields__ else {}))
            if windows:
                self.vocabulary.try_windows(impairment, windows)
        except (ValueError, OSError) as error:
            refuse(error, table, place, self.problems)

    def _links(self, on: str | None, place: Place, media: Mapping[str, MediumSpec]) -> tuple[Link, ...]:
        if on is None:
            return ()
        try:
            return tuple(self.vocabulary.select_links(on, {name: medium.nodes for name, medium in media.items()}))
        except ValueError as error:
            self.problems.add((*place, "on"), str(error), on)
            return ()

    def _windows(self, during_ns: Sequence[Any], table: Mapping[str, Any], place: Place) -> tuple[Window, ...]:
        key = next(key for key in spellings("during_ns") if key in table)
        single = not during_ns or not isinstance(during_ns[0], list)
        windows: list[Window] = []
        for index, window in enumerate([list(during_ns)] if single else during_ns):
            where, written = ((*place, key), table[key]) if single else ((*place, key, index), table[key][index])
            if not isinstance(window, list) or len(window) != 2 or not all(isinstance(edge, int) for edge in window):
                self.problems.add(where, "expected [start, end], or a list of such windows", written)
            elif not 0 <= window[0] < window[1]:
                self.problems.add(where, "expected 0 <= start < end", written)
            else:
                windows.append((window[0], window[1]))
        return tuple(windows)

    def _expect(self, tables: Mapping[str, Any], agents: Mapping[str, AgentSpec],
                media: Mapping[str, MediumSpec]) -> dict[str, Bound]:
        bounds: dict[str, Bound] = {}
        shape = Shape({"min": float, "max": float}, frozenset())
        for key, table in tables.items():
            place = ("expect", key)
            filled = fill(shape, table, place, self.problems, self.folder)
            bound = bounds[key] = Bound(**filled.values)
            if not filled.complete:
                continue
            if bound.min is None and bound.max is None:
                self.problems.add(place, "expects nothing; give min, max or both", table)
            elif bound.min is not None and bound.max is not None and bound.min > bound.max:
                self.problems.add(place, "expected min <= max", table)
        for line in self.vocabulary.unknown_figures(bounds, list(agents), list(media)):
            self.problems.say(line)
        return bounds

    def _kind(self, table: Any, place: Place, kinds: Mapping[str, type]) -> Any:
        if not isinstance(table, dict):
            self.problems.add(place, "expected a table", table)
            return None
        if "kind" not in table:
            self.problems.add((*place, "kind"), f"is missing; {near('', kinds)}")
            return None
        kind = table["kind"]
        if not isinstance(kind, str) or kind not in kinds:
            self.problems.add((*place, "kind"), f"no such kind; {near(kind, kinds)}", kind)
            return None
        return kinds[kind]

    def _check_name(self, place: Place, name: str) -> None:
        plain = name.isascii() and name.replace("-", "").replace("_", "").isalnum() and name[:1].isalpha()
        if not plain:
            self.problems.add(place, NAME_RULE)


def _ask_programs(scenario: Scenario, programs: Mapping[type, str], problems: Problems) -> None:
    """A program's class may refuse a run that its domain knows to be impossible."""
    for cls, program in programs.items():
        check = getattr(cls, "check", None)
        if check is None:
            continue
        try:
            found: Iterable[str] = check(scenario) or ()
            for problem in found:
                problems.say(problem)
        except (ValueError, ArithmeticError) as error:
            problems.say(f"{program}: {error}")


def _merged(defaults: dict[str, Any], table: dict[str, Any]) -> dict[str, Any]:
    """`table` over `defaults`, tables within tables too; a time in `table` replaces one in another unit."""
    merged = {key: value for key, value in defaults.items() if not any(other in table for other in siblings(key))}
    for key, value in table.items():
        below = merged.get(key)
        merged[key] = _merged(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
    return merged


def _holds(table: Any, path: Place) -> bool:
    for part in path:
        entries = range(len(table)) if isinstance(table, list) else table if isinstance(table, dict) else ()
        if part not in entries:
            return False
        table = table[part]
    return True
