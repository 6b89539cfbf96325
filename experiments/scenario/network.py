"""Reads `[media]` and `[[impairments]]`."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from random import Random
from typing import Any

from experiments.scenario.impairment_kind import import_impairment
from experiments.scenario.model import AgentSpec, GatewaySpec, ImpairmentSpec, Link, MediumSpec, positions
from experiments.scenario.plant_parameters import plant_names
from experiments.scenario.problems import Place, near, path_text
from experiments.scenario.refusals import refuse
from experiments.scenario.sections import Reading
from experiments.scenario.shape import shape_of
from experiments.scenario.units import spellings
from netem.core import link_selector
from netem.core.agenda import Agenda
from netem.core.random_streams import stream
from netem.impairments.construct import construct_impairment
from netem.impairments.recordings import Recordings
from netem.impairments.table import IMPAIRMENTS
from netem.impairments.window import Window
from netem.media import MediumSettings
from netem.media.links import Links
from netem.media.table import MEDIA
from netem.records.ledger import Ledger


@dataclass(frozen=True)
class ImpairmentHeader:
    on: str
    during_ns: tuple[Any, ...] = ()
    name: str = ""
    shared: bool = False


class Network:
    """Reads media and impairments; `built` has the media without mistakes, built once to be asked for links."""

    def __init__(self, reading: Reading, seed: int) -> None:
        self.reading = reading
        self.seed = seed
        self.problems = reading.problems
        self.folder = reading.folder
        self.built: dict[str, Any] = {}
        self.recordings = Recordings()

    def medium(self, name: str, table: Any, agents: Mapping[str, AgentSpec],
               gateways: Mapping[str, GatewaySpec]) -> MediumSpec:
        place = ("media", name)
        self.reading.check_name(place, name)
        nodes = (*(agent.name for agent in agents.values() if name in agent.media),
                 *(gateway.name for gateway in gateways.values() if gateway.medium == name))
        if not isinstance(table, dict):
            self.problems.add(place, "expected a table", table)
            return MediumSpec(name, "", None, nodes)
        cls = self._kind(table.get("kind"), place, MEDIA)
        if cls is None:
            return MediumSpec(name, "", None, nodes)
        rest = {key: value for key, value in table.items() if key != "kind"}
        settings = self.reading.tables.read(shape_of(cls.Settings), rest, place, ["kind"], cls.Settings).made
        if settings is None:
            return MediumSpec(name, table["kind"], None, nodes)
        if nodes:
            ledger = Ledger()
            try:
                self.built[name] = cls(name, settings, positions(nodes, agents), Agenda(), ledger,
                                       Links(ledger, lambda *_: False, {}), partial(stream, self.seed))
            except ValueError as error:
                refuse(error, rest, place, self.problems)
        self._check_poses(settings, agents, nodes, (*place, *settings.poses_key))
        return MediumSpec(name, table["kind"], settings, nodes, settings.floor_plan())

    def _check_poses(self, settings: MediumSettings, agents: Mapping[str, AgentSpec], nodes: Sequence[str],
                     place: Place) -> None:
        for name, pose in settings.poses().items():
            plant = agents[name].plant if name in agents else None
            if name in nodes and plant is None:
                self.problems.add((*place, name), "a body needs a plant, whose outputs say where it is")
            if plant is not None:
                names = plant_names(plant.fmu, self.folder)
                for output in pose.outputs:
                    if output not in names.outputs:
                        self.problems.add((*place, name), f"no such output; "
                                          f"{near(output, dict.fromkeys(names.outputs))}", output)
                    elif pose.unit and names.variables[output].unit not in (None, "", pose.unit):
                        self.problems.add((*place, name), f"has the unit {names.variables[output].unit}, expected "
                                          f"{pose.unit}", output)

    def tables_of_media(self, taken: Collection[str]) -> list[str]:
        """Return the names of the tables of signals that the media record; a problem for each that is `taken`."""
        found: dict[str, str] = {}
        for name, medium in self.built.items():
            for table in medium.tables():
                if table in taken or table in found:
                    self.problems.add(("media", name), f"it records signals as {table}, the name of another node or "
                                      "medium; rename that one")
                found[table] = name
        return list(found)

    def check_names(self, names: Iterable[Any]) -> None:
        """Check the names of the impairments, None for one without a name."""
        first: dict[str, Place] = {}
        for index, name in enumerate(names):
            if not isinstance(name, str):
                continue
            place: Place = ("impairments", index, "name")
            self.reading.check_name(place, name)
            if name in first:
                self.problems.add(place, f"the name of {path_text(first[name])} too, so both would draw the same; "
                                         "give each a name of its own", name)
            first.setdefault(name, ("impairments", index))

    def impairment(self, table: Any, place: Place, media: Mapping[str, MediumSpec]) -> ImpairmentSpec:
        """Return an impairment, built once here so that its errors are reported before the run."""
        if not isinstance(table, dict):
            self.problems.add(place, "expected a table", table)
            return ImpairmentSpec(path_text(place), "", (), (), "", {})
        kind = table.get("kind")
        cls: Any = (self._own_kind(kind, place) if isinstance(kind, str) and ":" in kind
                    else self._kind(kind, place, IMPAIRMENTS))
        common = shape_of(ImpairmentHeader)
        header = {key: value for key, value in table.items() if key in common.field_of}
        besides = shape_of(cls).keys() if cls is not None else []
        values = self.reading.tables.read(common, header, place, besides).values
        key = next((key for key in spellings("during_ns") if key in table), "")
        windows = self._windows(values["during_ns"], table[key], (*place, key)) if "during_ns" in values else ()
        fields: dict[str, Any] = {}
        if cls is not None:
            own = {key: value for key, value in table.items() if key not in [*header, "kind"]}
            try:
                fields, _, impairment = self.reading.tables.read(
                    shape_of(cls), own, place, [*common.keys(), "kind"],
                    lambda **fields: construct_impairment(cls, fields, Random(0), self.recordings))
                if windows and impairment is not None:
                    Window(impairment, windows)
            except ValueError as error:
                refuse(error, table, place, self.problems)
            except Exception as error:
                if cls in IMPAIRMENTS.values():
                    raise
                self.problems.add((*place, "kind"), f"constructing it failed: {type(error).__name__}: {error}",
                                  table["kind"])
        links = self._links(values.get("on"), place, media)
        return ImpairmentSpec(path_text(place), values.get("on", ""), links, windows, str(kind), fields,
                              values.get("name", ""), values.get("shared", False))

    def _links(self, on: str | None, place: Place, media: Mapping[str, MediumSpec]) -> tuple[Link, ...]:
        if on is None:
            return ()
        try:
            return tuple(link_selector.parse(on).resolve(
                {name: medium.nodes for name, medium in media.items()},
                {name: medium.settings.links_to_themselves() for name, medium in media.items()
                 if medium.settings is not None}))
        except ValueError as error:
            self.problems.add((*place, "on"), str(error), on)
            return ()

    def _windows(self, during_ns: Sequence[Any], during: Any, place: Place) -> tuple[tuple[int, int], ...]:
        """Return the windows [start_ns, end_ns); `during` is the value as written, for errors."""
        single = not during_ns or not isinstance(during_ns[0], list)
        windows: list[tuple[int, int]] = []
        for index, window in enumerate([list(during_ns)] if single else during_ns):
            where, written = (place, during) if single else ((*place, index), during[index])
            if not isinstance(window, list) or len(window) != 2 or not all(isinstance(edge, int) for edge in window):
                self.problems.add(where, "expected [start, end], or a list of such windows", written)
            elif not 0 <= window[0] < window[1]:
                self.problems.add(where, "expected 0 <= start < end", written)
            else:
                windows.append((window[0], window[1]))
        return tuple(windows)

    def _kind(self, kind: Any, place: Place, kinds: Mapping[str, type]) -> Any:
        if kind is None:
            self.problems.add((*place, "kind"), f"is missing; {near('', kinds)}")
            return None
        if not isinstance(kind, str) or kind not in kinds:
            self.problems.add((*place, "kind"), f"no such kind; {near(kind, kinds)}", kind)
            return None
        return kinds[kind]

    def _own_kind(self, kind: str, place: Place) -> Any:
        try:
            return import_impairment(kind, self.folder)
        except ValueError as error:
            self.problems.add((*place, "kind"), str(error), kind)
        except Exception as error:
            self.problems.add((*place, "kind"), f"importing it failed: {type(error).__name__}: {error}", kind)
        return None
