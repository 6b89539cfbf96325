"""`marconet sweep`: reads the options, shows the progress, prints what came out and how to repeat it."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from experiments.run.exits import ExitCode, errors_as_text
from experiments.show.console import print_table

if TYPE_CHECKING:
    from experiments.judge.campaign import Campaign, Plan
    from experiments.judge.campaign_rates import Rate
    from experiments.show.console import Console
    from experiments.sweep.campaign import Progress, Swept, Wanted

MOST_COMMANDS: Final = 10       # runs that do not hold whose command is printed
MOST_SETTINGS: Final = 40


def run_sweep(console: Console, source: str, vary: Sequence[str], *, verbose: bool, as_json: bool,
              **options: Any) -> int:
    """Run the campaign and return the exit code of the command."""
    with errors_as_text(verbose):
        wanted = _wanted(source, vary, options)
    with errors_as_text(verbose, kept=wanted.out):
        from experiments.judge.campaign_rates import holds
        from experiments.sweep.campaign import sweep

        with _view(console) as progress:
            swept = sweep(wanted, progress)
        if as_json:
            from experiments.show.json_output import print_json

            print_json(_as_json(swept))
        _print(console, swept)
        return ExitCode.NODE_FAILED if any(row.figures.failure for row in swept.campaign.rows) else \
            ExitCode.DONE if holds(swept.campaign) else ExitCode.EXPECTATION_BROKEN


def _wanted(source: str, vary: Sequence[str], given: dict[str, Any]) -> Wanted:
    from experiments.scenario import find
    from experiments.sweep.campaign import Wanted
    from experiments.sweep.messages import Source
    from experiments.sweep.vary import BadCampaign, parse

    if given["sample"] is None and given["runs"] is not None:
        raise BadCampaign(f"--runs {given['runs']}: a grid has as many settings as its values give: say --sample "
                          "latin, or --seeds N for more runs of each")
    if given["sample"] is not None and given["runs"] is None:
        raise BadCampaign(f"--sample {given['sample']}: how many settings? give --runs N")
    if given["resume"] and given["out"] is None:
        raise BadCampaign("--resume: which campaign? name its folder with --out")
    path = find(source)
    out = given["out"] or Path("runs") / f"{path.stem}-{datetime.now():%Y%m%d-%H%M%S-%f}"
    return Wanted(Source.of(path, given["duration_s"], tuple(given["overrides"])), [parse(text) for text in vary],
                  given["seeds"], given["seed"], given["runs"], given["host"], given["jobs"], given["cluster"],
                  given["resume"], out, given["folders"])


@contextmanager
def _view(console: Console) -> Iterator[Progress]:
    from experiments.show.live_view import campaign_view

    with campaign_view(console, "campaign") as tell:
        yield tell


def _print(console: Console, swept: Swept) -> None:
    from experiments.judge.campaign_rates import not_shown
    from experiments.judge.campaign_statistics import mean, share
    from experiments.scenario.problems import value_text
    from experiments.show.campaign.build import estimate, percent
    from experiments.show.text_views import print_path

    campaign, plan = swept.campaign, swept.campaign.plan
    table = []
    for place, setting in list(enumerate(plan.settings))[:MOST_SETTINGS]:
        rows = campaign.of_setting(place)
        held = sum(row.figures.holds for row in rows)
        table.append([*(value_text(setting[key]) for key in plan.varied), str(len(rows)),
                      estimate(share(held, len(rows)), True), *(estimate(mean(campaign.values(key, rows)))
                                                                for key in campaign.keys)])
    print_table(console, [*plan.varied, "runs", "hold", *campaign.keys], table)
    if len(plan.settings) > MOST_SETTINGS:
        console.print(f"the first {MOST_SETTINGS} of {len(plan.settings)} settings; the report has more",
                      soft_wrap=True)
    console.print()
    _print_rates(console, campaign)
    whole_s = sum(row.figures.whole_s for row in campaign.rows)
    if whole_s:
        emulated = percent(sum(row.figures.emulation_s for row in campaign.rows) / whole_s)
        console.print(f"{emulated} of {whole_s:.4g} s of processor time was emulation", soft_wrap=True)
    commands = swept.commands(MOST_COMMANDS)
    for row, command in commands:
        what = "failed" if row.figures.failure else "holds" if row.figures.holds else "does not hold"
        folder = swept.repeated.get(row.number)
        console.print(f"run {row.number} {what}: {command}" + (f"\n  its records: {folder}" if folder else ""),
                      soft_wrap=True)
    if more := len(campaign.failed()) - sum(not row.figures.holds for row, _ in commands):
        console.print(f"and {more} more that {'do' if more > 1 else 'does'} not hold: see the report, or runs.parquet "
                      "for all", soft_wrap=True)
    for line in swept.warnings:
        print(f"warning: {line}", file=sys.stderr)
    print_path(console, "runs", swept.folder / "runs.parquet")
    print_path(console, "report", swept.report)
    for rate in not_shown(campaign):
        print(f"expect.{rate.key}: kept by {rate.kept} of {rate.runs} runs{_where(plan, rate)}: {rate.in_words()}",
              file=sys.stderr)
    if failed := campaign.failed():
        crashed = sum(bool(row.figures.failure) for row in failed)
        print(f"{len(failed)} of {len(campaign.rows)} runs do not hold" +
              (f", {crashed} of them failed" if crashed else ""), file=sys.stderr)


def _print_rates(console: Console, campaign: Campaign) -> None:
    """Print the rates of the expectations that not every run keeps, or that expect a share."""
    from experiments.judge.campaign_rates import rates
    from experiments.scenario.problems import value_text
    from experiments.show.campaign.build import estimate

    plan = campaign.plan
    told = [rate for rate in rates(campaign) if rate.share is not None or rate.kept < rate.runs]
    if not told:
        return
    print_table(console, [*plan.varied, "expectation", "kept by", "share of the runs", ""], [
        [*(value_text(plan.settings[rate.setting][key]) for key in plan.varied), rate.key,
         f"{rate.kept} of {rate.runs}", estimate(rate.estimate, True), rate.in_words()]
        for rate in told[:MOST_SETTINGS]])
    if len(told) > MOST_SETTINGS:
        console.print(f"the first {MOST_SETTINGS} of {len(told)}; the report has more", soft_wrap=True)
    console.print()


def _where(plan: Plan, rate: Rate) -> str:
    from experiments.scenario.problems import value_text

    setting = plan.settings[rate.setting]
    return f" with {', '.join(f'{key}={value_text(setting[key])}' for key in plan.varied)}" if plan.varied else ""


def _as_json(swept: Swept) -> dict[str, Any]:
    from experiments.judge.campaign_rates import rates

    plan = swept.campaign.plan
    return {"folder": swept.folder, "report": swept.report, "warnings": swept.warnings,
            "expectations": [{"settings": plan.settings[rate.setting], "key": rate.key, "kept": rate.kept,
                              "runs": rate.runs, "share": rate.estimate.value,
                              "interval": [rate.estimate.low, rate.estimate.high], "expected_share": rate.share,
                              "showing": None if rate.showing is None else rate.showing.value}
                             for rate in rates(swept.campaign)],
            "runs": [{"number": row.number, "settings": plan.settings[row.setting], "seed": row.seed,
                      "ledger_hash": row.figures.ledger_hash, "holds": row.figures.holds,
                      "failure": row.figures.failure, "figures": row.figures.values,
                      "records": swept.repeated.get(row.number)} for row in swept.campaign.rows]}
