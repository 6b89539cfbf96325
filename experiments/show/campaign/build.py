"""`report.html` of a campaign: how many runs hold, the figures by setting with intervals, plots, the worst runs."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Mapping
from importlib.resources import files
from itertools import islice
from pathlib import Path
from typing import Any, Final

import msgspec
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from experiments.judge.campaign import Campaign, Row
from experiments.judge.campaign_rates import Rate, holds, rates
from experiments.judge.campaign_statistics import CONFIDENCE, Estimate, mean, share
from experiments.scenario.problems import value_text
from experiments.show.campaign.curves import plots
from experiments.show.report.palette import CURVES
from experiments.show.report.plotly_file import plotly_source
from netem.records.part_file import write_whole

MOST_SETTINGS: Final = 200              # rows of the table of settings
MOST_RATES: Final = 1000                # rows of the table of expectations
MOST_FAILURES: Final = 50               # rows of the table of runs that do not hold
REPORT: Final = "report.html"

Json = dict[str, Any]


def write_campaign_report(campaign: Campaign, repeated: Mapping[int, Path]) -> Path:
    """Write the report and return its path; `repeated` maps runs to the folders of their records."""
    path = campaign.folder / REPORT
    write_whole(path, render(campaign, repeated).encode())
    return path


def render(campaign: Campaign, repeated: Mapping[int, Path]) -> str:
    plan, rows = campaign.plan, campaign.rows
    held = sum(row.figures.holds for row in rows)
    failed, worst = campaign.failed(), campaign.worst()
    text: str = page("campaign.html.j2", plots(campaign)).render(
        **common(), plan=plan, runs=len(rows), held=held, share=share(held, len(rows)) if rows else None,
        crashed=sum(bool(row.figures.failure) for row in rows), keys=campaign.keys,
        holds=holds(campaign), rates=[_rate(campaign, rate) for rate in islice(rates(campaign), MOST_RATES)],
        settings=[_setting(campaign, place) for place in range(min(len(plan.settings), MOST_SETTINGS))],
        settings_total=len(plan.settings), varied=[(key, _values(plan.settings, key)) for key in plan.varied],
        failures=[_run(campaign, row, repeated, _why(campaign, row)) for row in failed[:MOST_FAILURES]],
        failures_total=len(failed),
        worst=[_run(campaign, row, repeated, _judged(campaign, row, key)) for key, row in worst.items()],
        seconds=sum(row.figures.whole_s for row in rows), emulation=sum(row.figures.emulation_s for row in rows))
    return text


def page(name: str, drawn: list[Json]) -> Any:
    """Return the template `name` with the data that the page's script draws."""
    environment = Environment(loader=PackageLoader("experiments.show.campaign", "page"), autoescape=True,
                              undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= {"number": number, "estimate": estimate, "percent": percent}
    environment.globals |= {"drawn": drawn, "data_json": Markup(
        msgspec.json.encode({"plots": drawn, "curves": CURVES}).decode().replace("<", "\\u003c"))}
    return environment.get_template(name)


def common() -> Json:
    """Return what every page of campaigns contains."""
    own = files("experiments.show.campaign") / "page"
    return {"plotly": Markup(plotly_source()), "confidence": f"{CONFIDENCE:.0%}",
            "style": Markup((files("experiments.show.report") / "page" / "report.css").read_text("utf-8")),
            "script": Markup((own / "campaign.js").read_text("utf-8"))}


def number(value: float | None) -> str:
    return "" if value is None else f"{value:.5g}"


def percent(value: float) -> str:
    return f"{100 * value:.3g} %"


def estimate(found: Estimate | None, of_share: bool = False) -> str:
    """Return "value [low, high]", without the interval if there is none."""
    if found is None:
        return "–"
    text = percent if of_share else number
    return text(found.value) + ("" if found.low is None or found.high is None
                                else f" [{text(found.low)}, {text(found.high)}]")


def _setting(campaign: Campaign, place: int) -> Json:
    rows = campaign.of_setting(place)
    return {"values": [value_text(campaign.plan.settings[place][key]) for key in campaign.plan.varied],
            "runs": len(rows), "share": share(sum(row.figures.holds for row in rows), len(rows)) if rows else None,
            "figures": [mean(campaign.values(key, rows)) for key in campaign.keys]}


def _rate(campaign: Campaign, rate: Rate) -> Json:
    plan = campaign.plan
    bound = plan.bounds[rate.key]
    return {"values": [value_text(plan.settings[rate.setting][key]) for key in plan.varied], "key": rate.key,
            "min": bound.min, "max": bound.max, "kept": rate.kept, "runs": rate.runs, "estimate": rate.estimate,
            "words": rate.in_words()}


def _run(campaign: Campaign, row: Row, repeated: Mapping[int, Path], why: str) -> Json:
    folder = repeated.get(row.number)
    plan = campaign.plan
    return {"number": row.number, "seed": row.seed, "why": why,
            "setting": ", ".join(f"{key}={value_text(value)}" for key, value in plan.settings[row.setting].items()),
            "link": None if folder is None or not (folder / REPORT).exists()
            else os.path.relpath(folder / REPORT, campaign.folder),
            "command": shlex.join(plan.repeat(row.setting, row.seed))}


def _why(campaign: Campaign, row: Row) -> str:
    if row.figures.failure:
        return row.figures.failure.splitlines()[0]
    bounds = campaign.plan.bounds
    broken = [key for key in row.figures.broken if key not in bounds or bounds[key].share is None]
    return ", ".join(f"{key} = {number(row.figures.values.get(key)) or 'no value'}" for key in broken)


def _judged(campaign: Campaign, row: Row, key: str) -> str:
    margin = campaign.margin(row, key)
    where = f"{number(margin)} within its bound" if margin >= 0 else f"{number(-margin)} beyond its bound"
    return f"{key} = {number(row.figures.values[key])}, {where}"


def _values(settings: Iterable[Mapping[str, Any]], key: str) -> str:
    found = list(dict.fromkeys(value_text(setting[key]) for setting in settings))
    return ", ".join(found) if len(found) <= 12 else f"{len(found)} values from {found[0]} to {found[-1]}"
