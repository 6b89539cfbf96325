"""Runs a campaign from Python: a scenario with varied keys and many seeds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Literal

from experiments.judge.campaign import Campaign
from marconet.running import GET_POLARS
from marconet.scenario import Scenario, plain_values

if TYPE_CHECKING:
    import polars as pl

    from experiments.sweep.campaign import Swept


class Sweep:
    """A campaign that has ended. `folder` holds its results (docs/howto/campaign.md), `report` is its page."""

    def __init__(self, swept: Swept) -> None:
        self.folder: Path = swept.folder
        self.report: Path = swept.report
        self.warnings: list[str] = list(swept.warnings)
        self.repeated: Mapping[int, Path] = dict(swept.repeated)
        self._campaign: Campaign = swept.campaign
        self._swept = swept

    @property
    def holds(self) -> bool:
        """Whether every run holds, and the runs show each share that `[expect]` asks for."""
        from experiments.judge.campaign_rates import holds

        return holds(self._campaign)

    @property
    def runs(self) -> pl.DataFrame:
        """One row for each run: number, setting, seed, ledger_hash, holds, failure, varied keys, figures."""
        try:
            import polars
        except ImportError as error:
            raise ImportError(GET_POLARS) from error
        return polars.read_parquet(self.folder / "runs.parquet")

    def repeat(self, number: int) -> str:
        """The command that repeats run `number` with all of its records."""
        import shlex

        row = next(row for row in self._campaign.rows if row.number == number)
        return shlex.join(self._campaign.plan.repeat(row.setting, row.seed))

    def __repr__(self) -> str:
        rows = self._campaign.rows
        return (f"<marconet.Sweep of {self._campaign.plan.scenario}: {sum(row.figures.holds for row in rows)} of "
                f"{len(rows)} runs hold; results in {self.folder}>")


def sweep(scenario: Scenario | str | PurePath, vary: Mapping[str, str | Iterable[Any]] | None = None, *,
          seeds: int = 1, first_seed: int | None = None, set: Mapping[str, Any] | None = None,     # as of `load`
          length_s: float | None = None, sample: Literal["grid", "latin"] = "grid", runs: int | None = None,
          host: Literal["inline", "process"] | None = None, jobs: int | None = None, cluster: str = "",
          resume: bool = False, out: str | PurePath | None = None, folders: int = 5) -> Sweep:
    """Run each setting of the scenario with each seed, and return the campaign when it has ended.

    `vary` gives the values of each key, as a list or as the text of `--vary` ("0:0.4:5"). `seeds` are those from
    `first_seed`, or from the scenario's, on. `sample="latin"` draws `runs` settings. The other arguments are those of
    `marconet sweep`; the scenario has to be that of a file, as other processes load it.

    Raises ScenarioError or ValueError before any run, NodeFailure never: a run that fails is a row with its reason.
    """
    from experiments.sweep import campaign
    from experiments.sweep.messages import Source
    from experiments.sweep.vary import BadCampaign, of_values, parse

    path, changes = file_of(scenario, "a campaign")
    seed = changes.pop("seed", None)
    first_seed = seed if first_seed is None else first_seed
    changes |= plain_values(dict(set or {}))
    if (sample == "latin") != (runs is not None):
        raise BadCampaign(f"sample={sample!r}, runs={runs}: a Latin hypercube needs runs, and a grid has none")
    varied = [parse(f"{key}={values}") if isinstance(values, str) else of_values(key, plain_values(list(values)))
              for key, values in (vary or {}).items()]
    return Sweep(campaign.sweep(campaign.Wanted(
        Source.of(path, length_s, (), changes), varied, seeds, first_seed, runs, host, jobs, cluster, resume,
        None if out is None else Path(out), folders)))


def file_of(scenario: Scenario | str | PurePath, what: str) -> tuple[Path, dict[str, Any]]:
    """Return the file of a scenario, and the values that replace those in it; `what` needs it, for the error."""
    from experiments.run.repeat import holds_run, made_with
    from experiments.scenario import find
    from experiments.sweep.vary import BadCampaign

    if not isinstance(scenario, Scenario):
        if holds_run(Path(scenario)):
            made = made_with(Path(scenario))
            return made.path, dict(made.changes)
        return find(Path(scenario) if isinstance(scenario, PurePath) else scenario), {}
    path = Path(scenario.checked.path)
    if not path.is_file():
        raise BadCampaign(f"{scenario.name}: was built in Python: {what} needs the file of a scenario, "
                          "which its processes load")
    return path, dict(scenario.checked.changes)
