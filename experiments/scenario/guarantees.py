"""Reads `[guarantees.NAME]`: requirements on every instant of the run, with the expectations that they imply."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, Final, Literal

from experiments.scenario.expect import check_share
from experiments.scenario.formula.check import Known, check, links_of
from experiments.scenario.guarantee_kinds import MONITORS
from experiments.scenario.metric_keys import GUARANTEE
from experiments.scenario.model import AgentSpec, Bound, CostSpec, DerivedSpec, GuaranteeSpec, Link, MediumSpec
from experiments.scenario.problems import Place, near, path_text
from experiments.scenario.sections import Reading
from experiments.scenario.shape import shape_of
from experiments.scenario.subjects import Named, Subject, formula_subjects, subjects_of

EXECUTIONS: Final = "executions"        # the guarantee that is added when programs declare automata


@dataclass(frozen=True)
class GuaranteeHeader:
    """The keys of every kind."""

    on: str
    expected: Literal["holds", "violated"] = "holds"
    share: float | None = None              # None: in every run


class Guarantees:
    """Reads the guarantees; `built` are the media without mistakes, `automata` the agents that declare an automaton,
    `length_ns` and `sample_period_ns` those of the run.
    """

    def __init__(self, reading: Reading, agents: Mapping[str, AgentSpec], media: Mapping[str, MediumSpec],
                 gateways: Collection[str], derived: Mapping[str, DerivedSpec], built: Mapping[str, Any],
                 automata: Collection[str], length_ns: int, sample_period_ns: int) -> None:
        self.reading = reading
        self.problems = reading.problems
        self.agents = agents
        self.media = media
        self.gateways = gateways
        self.derived = derived
        self.built = built
        self.automata = automata
        self.length_ns = length_ns
        self.sample_period_ns = sample_period_ns

    def read(self, tables: Mapping[str, Any]) -> dict[str, GuaranteeSpec]:
        """Return the guarantees of known kinds, also those with mistakes, as expectations may refer to them.

        If some programs declare automata and no table is about executions, a guarantee `EXECUTIONS` is added.
        """
        links = self.links if tables else []
        found = {name: self._guarantee(name, table, links) for name, table in tables.items()}
        known = {name: guarantee for name, guarantee in found.items() if guarantee is not None}
        if self.automata and not any(MONITORS[each.kind].ON is Named.EXECUTIONS for each in known.values()):
            if EXECUTIONS in tables:
                self.problems.add(("guarantees", EXECUTIONS), "this is the name of the guarantee that is added when "
                                  "programs declare automata; take another name")
            elif (added := self._guarantee(EXECUTIONS, {"kind": "execution", "on": "*"}, ())) is not None:
                known[EXECUTIONS] = added
        return known

    def links_of(self, on: str) -> list[Subject]:
        """Return the links that a selector names, of those that exist at some time of the run; ValueError if none."""
        return subjects_of(Named.LINKS, on, self._nodes_on(), self.links, ())

    def _guarantee(self, name: str, table: Any, links: Collection[Link]) -> GuaranteeSpec | None:
        place: Place = ("guarantees", name)
        self.reading.check_name(place, name)
        if not isinstance(table, dict):
            self.problems.add(place, "expected a table", table)
            return None
        common = shape_of(GuaranteeHeader)
        kind = table.get("kind")
        cls = MONITORS.get(kind) if isinstance(kind, str) else None
        if cls is None:
            rule = "is missing; " if kind is None else "no such kind; "
            self.problems.add((*place, "kind"), rule + near(kind or "", MONITORS),
                              *([] if kind is None else [kind]))
        header = {key: value for key, value in table.items() if key in common.field_of}
        own = {key: value for key, value in table.items() if key not in [*header, "kind"]}
        besides = ["kind", *(shape_of(cls).keys() if cls is not None else own)]
        values = self.reading.tables.read(common, header, place, besides).values
        if cls is None:
            return None
        filled = self.reading.tables.read(shape_of(cls), own, place, ["kind", *common.keys()], cls)
        on, share = values.get("on"), values.get("share")
        check_share(share, place, self.problems)
        subjects = () if on is None else self._subjects(cls, on, (*place, "on"), links)
        return GuaranteeSpec(str(kind), on or "", subjects, values.get("expected", "holds"), filled.values,
                             cls.UNIT, share)

    def _subjects(self, cls: Any, on: str, place: Place, links: Collection[Link]) -> tuple[Subject, ...]:
        nodes_on = self._nodes_on()
        if cls.ON is Named.FORMULA:
            return self._formula(on, place)
        reporting = self.automata if cls.ON is Named.EXECUTIONS else [*self.agents, *self.derived]
        if cls.ON.name == "SIGHTS":
            links = [link for link in links if self._shows(*link)]
        try:
            subjects = tuple(subjects_of(cls.ON, on, nodes_on, links, reporting))
        except ValueError as error:
            self.problems.add(place, str(error), on)
            return ()
        for node, *rest in subjects:
            if rest and node in self.derived and rest[0] not in self.derived[node].signals:
                known = near(rest[0], self.derived[node].signals)
                self.problems.add(place, f"derived.{node} has no signal {rest[0]!r}; {known}", on)
        if cls.ON.name in ("SIGNALS", "SIGHTS") and self.sample_period_ns == 0:
            self.problems.add(place, "no signal is sampled while sample_period_s is 0; give it a value", on)
        return subjects

    def _formula(self, on: str, place: Place) -> tuple[Subject, ...]:
        known = self.known()
        found = check(on, known, at_end=False)
        for error in found:
            self.problems.say(f"{path_text(place)}: {error.pointed()}")
        return () if found else tuple(formula_subjects(on, links_of(on, known)))

    def known(self, costs: Mapping[str, CostSpec] = MappingProxyType({})) -> Known:
        """Return the names that formulas may use."""
        signals: dict[str, Mapping[str, str] | None] = dict.fromkeys([*self.agents, *self.media])
        for medium in self.built.values():
            signals |= {name: dict(table) for name, table in medium.tables().items()}
        signals |= {name: {} for name in self.gateways} | {name: spec.signals for name, spec in self.derived.items()}
        return Known(signals, self.links_of, self.length_ns,
                     {name: (spec.unit, spec.nodes) for name, spec in costs.items()})

    def _shows(self, medium: str, sender: str, receiver: str) -> bool:
        """Return whether the receiver has a camera on this medium that can see the sender."""
        settings = self.media[medium].settings
        return settings is not None and settings.camera(receiver) is not None and sender in settings.poses()

    def _nodes_on(self) -> dict[str, tuple[str, ...]]:
        return {name: medium.nodes for name, medium in self.media.items()}

    @cached_property
    def links(self) -> list[Link]:
        """The links that exist at some time of the run; for a medium with mistakes, all pairs of its nodes."""
        found: list[Link] = []
        for name, medium in self.media.items():
            pairs = [(one, other) for one in medium.nodes for other in medium.nodes if one != other]
            if name in self.built:
                pairs = self.built[name].links(self.length_ns)
            found += [(name, *pair) for pair in pairs]
        return found


def implied(guarantees: Mapping[str, GuaranteeSpec]) -> dict[str, Bound]:
    """Return a bound on the violations of each guarantee: none, or at least one if it is expected to be violated."""
    return {f"{GUARANTEE}.{name}.violations":
            Bound(max=0.0, share=guarantee.share) if guarantee.expected == "holds" else
            Bound(min=1.0, share=guarantee.share) for name, guarantee in guarantees.items()}
