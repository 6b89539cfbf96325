"""Computes what the pages of campaigns draw, as plain lists: a mean or a share over a varied key, or points.

In a grid there is a curve over each varied key for every combination of the other keys, or one over all runs if there
are more than `MOST_CURVES`. In a Latin hypercube every setting is another, so runs are drawn as points.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from math import isfinite
from typing import Any, Final

from experiments.judge.campaign import Campaign, Row
from experiments.judge.campaign_statistics import Estimate, mean, share
from experiments.scenario.problems import value_text

Json = dict[str, Any]
MOST_CURVES: Final = 7
MOST_POINTS: Final = 5_000
HOLDS: Final = "share of runs that hold"


def plots(campaign: Campaign) -> list[Json]:
    """Return what is drawn: for each varied key the verdicts and every figure, or histograms if nothing is varied."""
    subjects: list[tuple[str, Callable[[Sequence[Row]], Estimate | None]]] = [
        (HOLDS, lambda rows: share(sum(row.figures.holds for row in rows), len(rows)) if rows else None)]
    subjects += [(key, partial(_mean, campaign, key)) for key in campaign.keys]
    if not campaign.plan.varied:
        return [_histogram(campaign, key) for key in campaign.keys if campaign.values(key)]
    if campaign.plan.sample == "latin":
        return [_points(campaign, varied, key) for varied in campaign.plan.varied for key in campaign.keys
                if campaign.values(key)]
    return [_curves(campaign, varied, name, estimate) for varied in campaign.plan.varied
            for name, estimate in subjects]


def _mean(campaign: Campaign, key: str, rows: Sequence[Row]) -> Estimate | None:
    return mean(campaign.values(key, rows))


def _curves(campaign: Campaign, varied: str, name: str,
            estimate: Callable[[Sequence[Row]], Estimate | None]) -> Json:
    settings = campaign.plan.settings
    others = [key for key in campaign.plan.varied if key != varied]
    combinations = list(dict.fromkeys(_words(setting, others) for setting in settings))
    pooled = len(combinations) > MOST_CURVES
    values = list({value_text(setting[varied]): setting[varied] for setting in settings}.values())
    curves = []
    for combination in [""] if pooled else combinations:
        found = []
        for value in values:
            places = {place for place, setting in enumerate(settings) if setting[varied] == value
                      and (pooled or _words(setting, others) == combination)}
            found.append(estimate([row for row in campaign.rows if row.setting in places]))
        there = [(value, item) for value, item in zip(values, found, strict=True)
                 if item is not None and isfinite(item.value)]
        curves.append({"label": combination, "x": [_x(value) for value, _ in there],
                       "y": [item.value for _, item in there],
                       "above": [0.0 if item.high is None else item.high - item.value for _, item in there],
                       "below": [0.0 if item.low is None else item.value - item.low for _, item in there]})
    return {"kind": "curves", "title": f"{name} over {varied}", "x": varied, "y": name, "curves": curves,
            "note": f"over all values of {', '.join(others)}" if pooled else "", **_bounds(campaign, name)}


def _points(campaign: Campaign, varied: str, key: str) -> Json:
    rows = [row for row in campaign.rows if isfinite(row.figures.values.get(key) or 0.0)
            and row.figures.values.get(key) is not None][:MOST_POINTS]
    groups = []
    for label, chosen in (("holds", [row for row in rows if row.figures.holds]),
                          ("does not hold", [row for row in rows if not row.figures.holds])):
        groups.append({"label": label, "x": [_x(campaign.plan.settings[row.setting][varied]) for row in chosen],
                       "y": [row.figures.values[key] for row in chosen],
                       "text": [f"run {row.number}, seed {row.seed}" for row in chosen]})
    return {"kind": "points", "title": f"{key} over {varied}", "x": varied, "y": key, "groups": groups, "note": "",
            **_bounds(campaign, key)}


def _histogram(campaign: Campaign, key: str) -> Json:
    values = [value for value in campaign.values(key) if isfinite(value)]
    return {"kind": "histogram", "title": key, "x": key, "y": "runs", "values": values, "note": "",
            **_bounds(campaign, key)}


def _bounds(campaign: Campaign, key: str) -> Json:
    bound = campaign.plan.bounds.get(key)
    return {"min": bound.min if bound else None, "max": bound.max if bound else None}


def _words(setting: Json, keys: Sequence[str]) -> str:
    return ", ".join(f"{key}={value_text(setting[key])}" for key in keys)


def _x(value: Any) -> Any:
    return value if isinstance(value, int | float) and not isinstance(value, bool) else value_text(value)


def overlaid(entries_a: Sequence[Json], entries_b: Sequence[Json], names: tuple[str, str]) -> list[Json]:
    """Join the signals of two runs, as `report.series.signals` gives them: those of one name in one entry."""
    there = {entry["name"]: entry for entry in entries_b}
    joined = []
    for entry in entries_a:
        other = there.get(entry["name"])
        curves = [curve | {"run": 0, "label": f"{names[0]}: {curve['label']}"} for curve in entry["curves"]]
        curves += [curve | {"run": 1, "label": f"{names[1]}: {curve['label']}"}
                   for curve in (other["curves"] if other else ())]
        joined.append({"name": entry["name"], "unit": entry["unit"], "curves": curves})
    return joined


