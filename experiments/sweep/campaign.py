"""Runs a campaign: checks every setting, runs what has not been run, keeps each result, repeats the worst with records.

    settings x seeds --check--> points --workers | cluster--> results --> runs.parquet, report.html, runs/NUMBER

Nothing runs before all settings have been checked. Whatever ends a campaign (Ctrl-C, a full disk, a lost cluster), the
runs that have ended are kept, and `resume` goes on with the others.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any, Final, Protocol

from experiments.judge.campaign import Campaign, Plan, Row
from experiments.judge.figures import Figures
from experiments.run.runner import NeedsRealTime
from experiments.scenario.blocking_programs import repeating_host
from experiments.scenario.problems import ScenarioError
from experiments.sweep.messages import Host, Point, Source
from experiments.sweep.results import Results
from experiments.sweep.vary import BadCampaign, Varied, grid, latin
from experiments.sweep.workers import Workers

FOLDERS: Final = 5              # runs that are repeated with their records, unless said otherwise
LARGEST_SEED: Final = 2**63

Progress = Callable[[int, int, int], None]      # runs that have ended, of how many, of which do not hold


class Evaluator(Protocol):
    """Runs points: `Workers`, or `Cluster`."""

    def check(self, settings: Sequence[dict[str, Any]]) -> list[str]: ...

    def evaluate(self, points: Iterable[Point]) -> Iterator[tuple[Point, Figures]]: ...


@dataclass
class Wanted:
    """What to run. `host` None: inline, unless a program is blocking code. `jobs` None: one for each core that is free.

    `latin_runs` None: a grid of `varied`; else so many settings of a Latin hypercube, each with `seeds` seeds.
    `first_seed` None: the scenario's. `folders` is the number of runs that are repeated with their records.
    """

    source: Source
    varied: Sequence[Varied] = ()
    seeds: int = 1
    first_seed: int | None = None
    latin_runs: int | None = None
    host: Host | None = None
    jobs: int | None = None
    cluster: str = ""
    resume: bool = False
    out: Path | None = None
    folders: int = FOLDERS


@dataclass
class Swept:
    """`repeated` maps runs to the folders of their records; `warnings` are about the campaign itself."""

    campaign: Campaign
    folder: Path
    report: Path
    repeated: dict[int, Path] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)

    def commands(self, most: int) -> list[tuple[Row, str]]:
        """Return `most` runs that do not hold and the worst of each figure, by number, each with its command."""
        rows = {row.number: row for row in (*self.campaign.failed()[:most], *self.campaign.worst().values())}
        return [(rows[number], shlex.join(self.campaign.plan.repeat(rows[number].setting, rows[number].seed)))
                for number in sorted(rows)]


def sweep(wanted: Wanted, progress: Progress = lambda ended, total, broken: None) -> Swept:
    """Run the campaign and return what came out.

    Raises BadCampaign or ScenarioError before any run; NoCluster or ClusterLost, CannotKeep and KeyboardInterrupt with
    the results so far written.
    """
    plan, host = plan_of(wanted)
    with ExitStack() as stack:
        evaluator = stack.enter_context(_evaluator(wanted, host))
        if problems := evaluator.check(plan.settings[1:]):
            raise ScenarioError(problems)
        results = Results(wanted.out or Path("runs") / f"{plan.scenario}-{datetime.now():%Y%m%d-%H%M%S}", plan,
                          resume=wanted.resume)
        stack.callback(results.close)
        try:
            broken = sum(not row.figures.holds for row in results.rows.values())
            progress(len(results.rows), plan.runs, broken)
            for point, figures in evaluator.evaluate(results.waiting()):
                broken += not results.add(point, figures).figures.holds
                progress(len(results.rows), plan.runs, broken)
        except BaseException:
            with suppress(OSError):
                conclude(results)
            raise
        stack.pop_all().close()
    return conclude(results, wanted.folders)


def plan_of(wanted: Wanted) -> tuple[Plan, Host]:
    """Return the plan of a campaign and its host. Loads the first setting, and raises what is wrong with it."""
    if wanted.seeds < 1:
        raise BadCampaign(f"--seeds {wanted.seeds}: a campaign of no run: expected at least 1")
    if wanted.jobs is not None and wanted.jobs < 1:
        raise BadCampaign(f"--jobs {wanted.jobs}: expected at least 1")
    settings = grid(wanted.varied) if wanted.latin_runs is None else \
        latin(wanted.varied, wanted.latin_runs, wanted.first_seed or 0)
    scenario = wanted.source.load(settings[0])
    if scenario.gateways:
        raise NeedsRealTime(f"{scenario.name}: gateways.{next(iter(scenario.gateways))} lets somebody outside take "
                            "part, which needs real time: a campaign runs in virtual time")
    first = scenario.seed if wanted.first_seed is None else wanted.first_seed
    if not 0 <= first <= LARGEST_SEED - wanted.seeds:
        raise BadCampaign(f"--seed {first}: expected 0 <= seed < 2^63")
    host = wanted.host or repeating_host(scenario)
    source = wanted.source
    return Plan(scenario.name, scenario.question, source.path, source.digest, source.length_s, source.overrides,
                source.values, tuple(one.key for one in wanted.varied), tuple(settings),
                tuple(range(first, first + wanted.seeds)), host, dict(scenario.expect),
                "grid" if wanted.latin_runs is None else "latin"), host


def jobs_of(host: Host) -> int:
    """Return how many runs go on at a time on this machine: one for each core; with processes, one for two cores."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return cores if host == "inline" else max(1, cores // 2)


def _evaluator(wanted: Wanted, host: Host) -> Any:
    if wanted.cluster:
        from experiments.sweep.cluster import Cluster

        return Cluster(wanted.source, host, wanted.cluster)
    return Workers(wanted.source, host, wanted.jobs or jobs_of(host))


def conclude(results: Results, folders: int = 0) -> Swept:
    """Write `runs.parquet`, repeat the worst runs with their records, and write the report."""
    from experiments.show.campaign.build import write_campaign_report

    results.write()
    campaign = results.campaign()
    repeated: dict[int, Path] = {}
    warnings: list[str] = []
    report = write_campaign_report(campaign, repeated)
    if folders and campaign.rows:
        repeated, warnings = _repeat(campaign, folders)
        report = write_campaign_report(campaign, repeated)
    return Swept(campaign, results.folder, report, repeated, warnings)


def _repeat(campaign: Campaign, most: int) -> tuple[dict[int, Path], list[str]]:
    """Repeat runs that do not hold, then the worst of each figure, `most` in all; return their folders, by number."""
    plan = campaign.plan
    rows = {row.number: row for row in (*campaign.failed()[:most], *campaign.worst().values())}
    chosen = list(rows.values())[:most]
    points = [Point(row.number, plan.settings[row.setting], row.seed,
                    str((campaign.folder / "runs" / f"{row.setting}-{row.seed}").absolute()))
              for row in chosen]
    source = Source(plan.path, plan.digest, plan.length_s, plan.overrides, plan.values)
    host: Host = "process" if plan.host == "process" else "inline"
    repeated: dict[int, Path] = {}
    warnings: list[str] = []
    with Workers(source, host, min(jobs_of(host), max(1, len(points)))) as workers:
        for point, figures in workers.evaluate(points):
            row = rows[point.number]
            folder = campaign.folder / "runs" / f"{row.setting}-{row.seed}"
            _complete(folder, figures.failure, host)
            repeated[point.number] = folder
            before = row.figures.ledger_hash
            if before and figures.ledger_hash and before != figures.ledger_hash:
                warnings.append(f"run {point.number} (seed {point.seed}): repeated, it has another ledger hash: a "
                                "program uses what is not of the scenario, such as the time, or its files have changed")
    return repeated, warnings


def _complete(folder: Path, failure: str, host: str) -> None:
    """Make the records of a run during which its worker ended."""
    from experiments.run.killed_run import complete, is_unfinished
    from experiments.show.report.build import write_report

    if is_unfinished(folder):
        complete(folder, failure, host=host)
        with suppress(OSError):
            write_report(folder)
