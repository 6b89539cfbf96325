"""`marconet break`: finds the worst pattern of losses and faults within a budget, and writes it as a scenario.

    scenario --one run without losses--> frames of each link --strategy--> candidates --checked--> runs --costs--> ...

S-TaLiRo (Annpureddy, Liu, Fainekos, Sankaranarayanan 2011) searches initial states and inputs in this way, by the
robustness of a formula; here the pattern of a network is searched.

*Invariants*
- The outcome depends on the scenario, the budget and the seeds, not on the number of runs at a time.
- Every candidate was checked against the budget by `Space.check`, which has no part in making it.
- Impairments of the scenario that only lose frames are left out on the links of the budget: there the pattern is all
  that is lost.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from experiments.judge.figures import Figures
from experiments.run.runner import NeedsRealTime
from experiments.scenario.blocking_programs import repeating_host
from experiments.scenario.faults import site_for_search, site_of
from experiments.scenario.problems import ScenarioError
from experiments.search.base import Base, Tables, on_text, pure_losses, toml_of
from experiments.search.budget import BadBudget, Budget, read_budget
from experiments.search.fault_patterns import FaultSpace
from experiments.search.link_frames import link_frames
from experiments.search.loss_patterns import repeating
from experiments.search.objective import Objective
from experiments.search.strategy import Candidate, Evolution, Space, Strategy
from experiments.sweep.campaign import jobs_of
from experiments.sweep.messages import Host, Point, Source
from experiments.sweep.vary import Varied, at, refuse_twice
from experiments.sweep.workers import Workers
from netem.core.link_name import LinkName
from netem.impairments.changes import losing

Progress = Callable[[int], None]        # how many runs have ended since the last call; 0 before the first
StrategyOf = Callable[[Space, int, int], Strategy]


@dataclass
class Wanted:
    """What to search. `seed` is the search's own, `jobs` None: one run at a time for each core.

    `written` is the scenario of the worst so far, once the search has ended or was interrupted.
    """

    base: Base
    budgets: Sequence[str]
    objective: Objective
    runs: int
    varied: Sequence[Varied] = ()
    seed: int = 0
    jobs: int | None = None
    out: Path | None = None
    strategy: StrategyOf = Evolution
    written: Path | None = None


@dataclass
class Found:
    """The worst candidate: `value` of the figure, and `without` losses and faults. `number` is that of its run.

    Without a worse one than none, `file` is None and `number` -1. `costs` has the costs of all runs, in their order.
    """

    candidate: Candidate
    value: float
    without: float
    figures: Figures
    number: int = -1
    file: Path | None = None
    lines: list[str] = field(default_factory=list)      # the pattern in words
    costs: list[float] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    @property
    def runs(self) -> int:
        return len(self.costs)


def falsify(wanted: Wanted, progress: Progress = lambda more: None) -> Found:
    """Search and return the worst that was found; its scenario is written, if it is worse than no loss and no fault.

    Raises BadBudget, NoPlace or ScenarioError before the search.
    """
    base, objective = wanted.base, wanted.objective
    scenario = base.scenario
    if wanted.runs < 1:
        raise BadBudget(f"--runs {wanted.runs}: expected at least 1")
    if wanted.jobs is not None and wanted.jobs < 1:
        raise BadBudget(f"--jobs {wanted.jobs}: expected at least 1")
    if scenario.gateways:
        raise NeedsRealTime(f"{scenario.name}: gateways.{next(iter(scenario.gateways))} lets somebody outside take "
                            "part, which needs real time: a search runs in virtual time")
    if not wanted.budgets and not wanted.varied:
        raise BadBudget("what may the search change? Give --budget, as 'radio: * -> *: at most 2 lost in a row', or "
                        "--vary 'KEY=lo:hi'")
    refuse_twice(wanted.varied)
    site = site_of(scenario.agents, scenario.media, {}, ())
    budget = read_budget(wanted.budgets, site.nodes_on, site.to_themselves)
    file = base.place("worst", wanted.out)
    host: Host = repeating_host(scenario)
    with Workers(base.source, host, wanted.jobs or jobs_of(host)) as workers:
        making = Making(base, budget, objective, wanted.varied)
        middle = Candidate(settings=(0.5,) * len(wanted.varied))
        if problems := workers.check([making.values(middle)]):
            raise ScenarioError(problems)
        figures, frames = _first_run(workers, making, middle)
        making.frames = _usable(frames, budget, scenario.name)
        faults = FaultSpace(budget, site_for_search(scenario, frames), scenario.length_ns, scenario.faults)
        space = Space(budget, making.frames, faults, len(wanted.varied))
        return _search(wanted, workers, making, space, middle, figures, file, progress)


class Making:
    """Makes the values of a point, or the tables of a file, of candidates."""

    def __init__(self, base: Base, budget: Budget, objective: Objective, varied: Sequence[Varied]) -> None:
        self.base = base
        self.budget = budget
        self.objective = objective
        self.varied = varied
        self.frames: dict[LinkName, int] = {}
        losing = {index: [link for link in spec.links if link not in budget.losses]
                  for index, spec in pure_losses(base.scenario) if any(link in budget.losses for link in spec.links)}
        self._left: dict[int, list[LinkName]] = losing          # links on which these impairments stay

    def settings(self, candidate: Candidate) -> dict[str, Any]:
        return {one.key: at(one, share) for one, share in zip(self.varied, candidate.settings, strict=True)}

    def tables(self, candidate: Candidate) -> Tables:
        tables = self.base.changed(self.settings(candidate))
        kept: list[Any] = []
        for index, table in enumerate(tables.get("impairments", [])):
            kept += [table] if index not in self._left else [
                {key: value for key, value in table.items() if key != "name"} | {"on": on_text(link)}
                for link in self._left[index]]
        return tables | {"impairments": kept + self._losses(candidate),
                         "faults": [*tables.get("faults", []), *(fault.table() for fault in candidate.faults)]}

    def values(self, candidate: Candidate) -> dict[str, Any]:
        tables = self.tables(candidate)
        bound = 1e300 if self.objective.largest else -1e300
        changed = {"impairments": tables["impairments"], "faults": tables["faults"],
                   "expect": self.objective.expect(tables.get("expect", {}), bound)}
        return {**{key: value for key, value in self.settings(candidate).items()
                   if key.partition("[")[0].partition(".")[0] not in changed}, **changed}

    def file(self, candidate: Candidate, without: float, told: str) -> str:
        tables = self.tables(candidate)
        expected = self.objective.expect(tables.get("expect", {}), without)
        return toml_of(tables | {"expect": expected}, told, self.base.question)

    def _losses(self, candidate: Candidate) -> list[Tables]:
        """Return an entry for each link, or one for all links of a medium that lose the same frames."""
        scripts = {link: repeating(pattern, self.frames[link], self.budget.losses[link])
                   for link, pattern in candidate.losses}
        found = []
        for medium in dict.fromkeys(link[0] for link in scripts):
            own = {link: script for link, script in scripts.items() if link[0] == medium}
            nodes = self.base.scenario.media[medium].nodes
            all_links = len(nodes) * (len(nodes) - 1)
            if len(set(own.values())) == 1 and len(own) == all_links > 1:
                found.append(losing(f"{medium}: * -> *", *next(iter(own.values()))))
            else:
                found += [losing(on_text(link), *script) for link, script in own.items()]
        return found

    def in_words(self, candidate: Candidate) -> list[str]:
        lines = [f"{on_text(link)}: {len(pattern)} of {self.frames[link]} frames are lost"
                 for link, pattern in candidate.losses]
        lines += [fault.in_words() for fault in candidate.faults]
        return [*lines, *(f"{key} = {value}" for key, value in self.settings(candidate).items())]


def _first_run(workers: Workers, making: Making, middle: Candidate) -> tuple[Figures, dict[LinkName, int]]:
    """Run without losses and faults; return the figures, and how many copies entered each link."""
    with TemporaryDirectory(prefix="marconet-") as folder:
        point = Point(0, making.values(middle), making.base.scenario.seed, folder=str(Path(folder) / "run"))
        (_, figures), = workers.evaluate([point])
        if figures.failure:
            raise BadBudget(f"{making.base.scenario.name}: fails without any loss or fault already: {figures.failure}: "
                            "let it come to its end first")
        entered = link_frames(Path(point.folder), making.base.scenario)
        return figures, {link: len(frames) for link, frames in entered.items()}


def _usable(frames: dict[LinkName, int], budget: Budget, name: str) -> dict[LinkName, int]:
    found = {link: frames[link] for link in budget.losses if frames.get(link)}
    if budget.losses and not found:
        first = on_text(next(iter(budget.losses)))
        raise BadBudget(f"{name}: no frame is received on {first}" + (
            f" nor on {len(budget.losses) - 1} more links of the budget" if len(budget.losses) > 1 else "") +
            ", so nothing can use it: name links that carry frames, or run it for longer")
    return found


def _search(wanted: Wanted, workers: Workers, making: Making, space: Space, middle: Candidate, first: Figures,
            file: Path, progress: Progress) -> Found:
    objective, seed = wanted.objective, wanted.base.scenario.seed
    without = objective.cost(first)
    if without == inf:
        raise BadBudget(f"{objective.text}: the run without losses has no such figure, so there is nothing to search")
    found = Found(middle, objective.value(without), objective.value(without), first)
    best: tuple[float, int] = (without, 0)
    strategy = wanted.strategy(space, wanted.runs, wanted.seed)
    progress(0)
    try:
        while found.runs < wanted.runs:
            candidates = strategy.ask()[:wanted.runs - found.runs]
            for candidate in candidates:
                broken = space.check(candidate)
                assert not broken, broken
            of: dict[int, Figures] = {}
            for point, ended in workers.evaluate([Point(number, making.values(candidate), seed)
                                                  for number, candidate in enumerate(candidates)]):
                of[point.number] = ended
                progress(1)
            told = [(objective.cost(of[number]), candidate) for number, candidate in enumerate(candidates)]
            for number, (cost, candidate) in enumerate(told):
                if (cost, candidate.size) < best:
                    best = cost, candidate.size
                    found.candidate, found.figures, found.number = candidate, of[number], found.runs
                found.costs.append(cost)
            found.value = objective.value(best[0])
            strategy.tell(told)
    finally:
        if found.number >= 0:
            _write(found, file, making, wanted)
    if found.number >= 0:
        _repeat(found, file, wanted)
    return found


def _write(found: Found, file: Path, making: Making, wanted: Wanted) -> None:
    """Write the scenario, also when the search is interrupted."""
    base, objective = wanted.base, wanted.objective
    budgets = "".join(f"\n  {text}" for text in wanted.budgets)
    what = "largest" if objective.largest else "least"
    told = (f"The {what} {objective.text} that `marconet break {base.path.name}` found in {found.runs} runs:"
            f"\n{found.value:.6g}, and {found.without:.6g} without losses and faults. Budget:{budgets or ' none'}\n")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(making.file(found.candidate, found.without, told), encoding="utf-8")
    found.file, found.lines = file, making.in_words(found.candidate)
    wanted.written = file


def _repeat(found: Found, file: Path, wanted: Wanted) -> None:
    """Run the file that was written, and warn if that is another run than the one that was found."""
    scenario = wanted.base.scenario
    try:
        with Workers(Source.of(file), repeating_host(scenario), 1) as workers:
            (_, repeated), = workers.evaluate([Point(0, {}, scenario.seed)])
    except ScenarioError as error:
        found.warnings.append(f"{file}: does not load from there in another process: {error.problems[0]}: move it to "
                              f"{wanted.base.path.parent}")
        return
    if repeated.ledger_hash != found.figures.ledger_hash:
        found.warnings.append(f"{file}: its run has another ledger hash than the run that was found: a program uses "
                              "what is not of the scenario, such as the time, or its files have changed")
