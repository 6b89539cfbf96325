"""`[media]` and `[[impairments]]`: what carries frames, and what goes wrong on the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

from experiments.scenario.fill import construct, fill
from experiments.scenario.impairment_kind import import_impairment
from experiments.scenario.model import AgentSpec, GatewaySpec, ImpairmentSpec, Link, MediumSpec, Window, positions
from experiments.scenario.problems import Place, near, path_text
from experiments.scenario.refusals import refuse
from experiments.scenario.sections import Reading
from experiments.scenario.shape import shape_of
from experiments.scenario.units import spellings
from netem.impairments.construct import construct_impairment
from netem.impairments.recordings import Recordings
from netem.media import MediumSettings


@dataclass(frozen=True)
class ImpairmentHeader:
    on: str
    during_ns: tuple[Any, ...] = ()
    name: str = ""


class Network:
    def __init__(self, reading: Reading) -> None:
        self.reading = reading
        self.problems = reading.problems
        self.folder = reading.folder
        self.vocabulary = reading.vocabulary
        self.recordings = Recordings()

    def media(self, tables: Mapping[str, Any], agents: Mapping[str, AgentSpec],
              gateways: Mapping[str, GatewaySpec]) -> dict[str, MediumSpec]:
        media: dict[str, MediumSpec] = {}
        for name, table in tables.items():
            place = ("media", name)
            self.reading.check_name(place, name)
            nodes = (*(agent.name for agent in agents.values() if name in agent.media),
                     *(gateway.name for gateway in gateways.values() if gateway.medium == name))
            at_m = positions(nodes, agents)
            cls = self._kind(table, place, self.vocabulary.media)
            if cls is None:
                media[name] = MediumSpec(name, "", None, nodes)
                continue
            rest = {key: value for key, value in table.items() if key != "kind"}
            settings = construct(cls.Settings, rest, place, self.problems, self.folder, besides=["kind"])
            if settings is not None and nodes:
                try:
                    self.vocabulary.try_medium(cls, name, settings, at_m)
                except ValueError as error:
                    refuse(error, rest, place, self.problems)
            if settings is None:
                media[name] = MediumSpec(name, table["kind"], None, nodes)
                continue
            media[name] = MediumSpec(name, table["kind"], settings, nodes, settings.floor_plan())
            self._check_poses(settings, agents, (*place, "bodies"))
        return media

    def _check_poses(self, settings: MediumSettings, agents: Mapping[str, AgentSpec], place: Place) -> None:
        for name, pose in settings.poses().items():
            plant = agents[name].plant if name in agents else None
            if name in agents and plant is None:
                self.problems.add((*place, name), "a body needs a plant, whose outputs say where it is")
            if plant is not None:
                known = self.vocabulary.plant_names(plant.fmu, self.folder).outputs
                for output in pose.outputs:
                    if output not in known:
                        self.problems.add((*place, name), f"no such output; {near(output, dict.fromkeys(known))}",
                                          output)

    def impairments(self, media: Mapping[str, MediumSpec]) -> tuple[ImpairmentSpec, ...]:
        tables = self.reading.document.get("impairments", [])
        if not isinstance(tables, list):
            self.problems.add(("impairments",), "expected a list: write [[impairments]]", tables)
            return ()
        self._check_names(tables)
        return tuple(self._impairment(table, ("impairments", index), media) for index, table in enumerate(tables))

    def _check_names(self, tables: Sequence[Any]) -> None:
        first: dict[str, Place] = {}
        for index, table in enumerate(tables):
            name = table.get("name") if isinstance(table, dict) else None
            if not isinstance(name, str):
                continue
            place: Place = ("impairments", index, "name")
            self.reading.check_name(place, name)
            if name in first:
                self.problems.add(place, f"the name of {path_text(first[name])} too, so both would draw the same; "
                                         "give each a name of its own", name)
            first.setdefault(name, ("impairments", index))

    def _impairment(self, table: Any, place: Place, media: Mapping[str, MediumSpec]) -> ImpairmentSpec:
        cls = (self._own_kind(table, place) if _names_a_class(table)
               else self._kind(table, place, self.vocabulary.impairments))
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
        return ImpairmentSpec(path_text(place), values.get("on", ""), links, windows, str(table.get("kind")), fields,
                              values.get("name", ""))

    def _try(self, cls: Any, fields: Mapping[str, Any], windows: Sequence[Window], table: Any, place: Place) -> None:
        """Construct the impairment, so that what it refuses is said before the run."""
        try:
            impairment = construct_impairment(cls, fields, Random(0), self.recordings)
            if windows:
                self.vocabulary.try_windows(impairment, windows)
        except (ValueError, OSError) as error:
            refuse(error, table, place, self.problems)
        except Exception as error:
            if cls in self.vocabulary.impairments.values():
                raise
            self.problems.add((*place, "kind"), f"constructing it failed: {type(error).__name__}: {error}",
                              table["kind"])

    def _links(self, on: str | None, place: Place, media: Mapping[str, MediumSpec]) -> tuple[Link, ...]:
        if on is None:
            return ()
        try:
            return tuple(self.vocabulary.select_links(
                on, {name: medium.nodes for name, medium in media.items()},
                {name: medium.settings.links_to_themselves() for name, medium in media.items()
                 if medium.settings is not None}))
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

    def _own_kind(self, table: Mapping[str, Any], place: Place) -> Any:
        try:
            return import_impairment(table["kind"], self.folder)
        except ValueError as error:
            self.problems.add((*place, "kind"), str(error), table["kind"])
        except Exception as error:
            self.problems.add((*place, "kind"), f"importing it failed: {type(error).__name__}: {error}", table["kind"])
        return None


def _names_a_class(table: Any) -> bool:
    return isinstance(table, dict) and isinstance(table.get("kind"), str) and ":" in table["kind"]
