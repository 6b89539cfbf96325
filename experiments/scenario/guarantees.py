"""`[guarantees.NAME]`: what has to hold at every instant of the run, and what `[expect]` takes from that by default."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal

from experiments.scenario.fill import fill
from experiments.scenario.metric_keys import GUARANTEE
from experiments.scenario.model import AgentSpec, Bound, DerivedSpec, GuaranteeSpec, Link, MediumSpec, positions
from experiments.scenario.problems import Place, near
from experiments.scenario.refusals import refuse
from experiments.scenario.sections import Reading
from experiments.scenario.shape import shape_of

Subject = tuple[str, ...]


@dataclass(frozen=True)
class GuaranteeHeader:
    """What every kind has."""

    on: str
    expected: Literal["holds", "violated"] = "holds"


class Guarantees:
    """Reads them; `length_ns` and `sample_period_ns` are the run's."""

    def __init__(self, reading: Reading, agents: Mapping[str, AgentSpec], media: Mapping[str, MediumSpec],
                 derived: Mapping[str, DerivedSpec], length_ns: int, sample_period_ns: int) -> None:
        self.reading = reading
        self.problems = reading.problems
        self.vocabulary = reading.vocabulary
        self.agents = agents
        self.media = media
        self.derived = derived
        self.length_ns = length_ns
        self.sample_period_ns = sample_period_ns

    def read(self, tables: Mapping[str, Any]) -> dict[str, GuaranteeSpec]:
        """Those that are known by kind, with mistakes in them too: expectations may refer to them."""
        links = self._links() if tables else []
        found = {name: self._guarantee(name, table, links) for name, table in tables.items()}
        return {name: guarantee for name, guarantee in found.items() if guarantee is not None}

    def _guarantee(self, name: str, table: Any, links: Collection[Link]) -> GuaranteeSpec | None:
        place: Place = ("guarantees", name)
        self.reading.check_name(place, name)
        if not isinstance(table, dict):
            self.problems.add(place, "expected a table", table)
            return None
        common = shape_of(GuaranteeHeader)
        kind = table.get("kind")
        cls = self.vocabulary.monitors.get(kind) if isinstance(kind, str) else None
        if cls is None:
            rule = "is missing; " if kind is None else "no such kind; "
            self.problems.add((*place, "kind"), rule + near(kind or "", self.vocabulary.monitors),
                              *([] if kind is None else [kind]))
        header = {key: value for key, value in table.items() if key in common.keys()}       # noqa: SIM118
        own = {key: value for key, value in table.items() if key not in [*header, "kind"]}
        besides = ["kind", *(shape_of(cls).keys() if cls is not None else own)]
        values = fill(common, header, place, self.problems, self.reading.folder, besides).values
        if cls is None:
            return None
        filled = fill(shape_of(cls), own, place, self.problems, self.reading.folder, ["kind", *common.keys()])
        if filled.complete:
            try:
                cls(**filled.values)
            except ValueError as error:
                refuse(error, own, place, self.problems)
        on = values.get("on")
        subjects = () if on is None else self._subjects(cls, on, (*place, "on"), links)
        return GuaranteeSpec(str(kind), on or "", subjects, values.get("expected", "holds"), filled.values,
                             cls.UNIT)

    def _subjects(self, cls: Any, on: str, place: Place, links: Collection[Link]) -> tuple[Subject, ...]:
        nodes_on = {name: medium.nodes for name, medium in self.media.items()}
        if cls.ON.name == "SIGHTS":
            links = [link for link in links if self._shows(*link)]
        try:
            subjects = tuple(self.vocabulary.subjects_of(cls.ON, on, nodes_on, links, [*self.agents, *self.derived]))
        except ValueError as error:
            self.problems.add(place, str(error), on)
            return ()
        for node, *rest in subjects:
            if node in self.derived and rest[0] not in self.derived[node].signals:
                known = near(rest[0], self.derived[node].signals)
                self.problems.add(place, f"derived.{node} has no signal {rest[0]!r}; {known}", on)
        if cls.ON.name in ("SIGNALS", "SIGHTS") and self.sample_period_ns == 0:
            self.problems.add(place, "no signal is sampled while sample_period_s is 0; give it a value", on)
        return subjects

    def _shows(self, medium: str, sender: str, receiver: str) -> bool:
        """Whether cameras of this medium can see the sender."""
        settings = self.media[medium].settings
        return settings is not None and sender in settings.poses()

    def _links(self) -> list[Link]:
        """Those that the media have at some time; all pairs of a medium that has mistakes of its own."""
        found: list[Link] = []
        for name, medium in self.media.items():
            pairs = [(one, other) for one in medium.nodes for other in medium.nodes if one != other]
            if medium.settings is not None and medium.nodes:
                at_m = positions(medium.nodes, self.agents)
                with suppress(ValueError):      # said of the medium itself
                    pairs = list(self.vocabulary.medium_links(self.vocabulary.media[medium.kind], name, medium.settings,
                                                              at_m, self.length_ns))
            found += [(name, *pair) for pair in pairs]
        return found


def implied(guarantees: Mapping[str, GuaranteeSpec]) -> dict[str, Bound]:
    """A guarantee that is stated is expected to hold, unless the scenario says that it is to be violated."""
    return {f"{GUARANTEE}.{name}.violations": Bound(max=0.0) if guarantee.expected == "holds" else Bound(min=1.0)
            for name, guarantee in guarantees.items()}
