"""Shows what differs: between two campaigns, or between two runs, one over the other; a table and a page."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, nan
from pathlib import Path
from typing import Any, Final

from experiments.judge.campaign import Campaign, is_campaign, load_campaign
from experiments.judge.difference import LEVEL, Difference, differences
from experiments.judge.run_data import RunData, load_run
from experiments.judge.run_files import SCENARIO
from experiments.scenario.counted import counted
from experiments.show.campaign.build import common, estimate, number, page
from experiments.show.campaign.curves import overlaid
from experiments.show.report.build import verdicts_of
from experiments.show.report.question_first import question_first
from netem.records.part_file import write_whole

PAGE: Final = "compare.html"

Json = dict[str, Any]


class NotComparable(ValueError):
    """Two folders are not two campaigns, nor two runs."""

    exit_code = 2


class Comparison:
    """`columns` and `rows` are a table; `lines` say what it means; `plots` are drawn on the page."""

    def __init__(self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], lines: Sequence[str],
                 plots: list[Json]) -> None:
        self.title = title
        self.columns = columns
        self.rows = rows
        self.lines = lines
        self.plots = plots

    def write(self, path: Path) -> Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, page("compare.html.j2", self.plots).render(
            **common(), heading=self.title, columns=self.columns, rows=self.rows, lines=self.lines).encode())
        return path


def compare(a: Path, b: Path) -> Comparison:
    """Compare the folders of two campaigns, or of two runs; NotComparable for anything else."""
    for folder in (a, b):
        if not is_campaign(folder) and not SCENARIO.is_in(folder):
            raise NotComparable(f"{folder}: " + ("holds neither a campaign nor a run" if folder.is_dir() else
                                                 "there is no such folder") +
                                ": give two folders of campaigns, or two of runs")
    if is_campaign(a) != is_campaign(b):
        raise NotComparable(f"{a} holds a {_kind(a)}, {b} a {_kind(b)}: give two of a kind")
    return _campaigns(load_campaign(a), load_campaign(b)) if is_campaign(a) else _runs(a, b)


def _kind(folder: Path) -> str:
    return "campaign" if is_campaign(folder) else "run"


def _campaigns(a: Campaign, b: Campaign) -> Comparison:
    found = differences(a, b)
    names = _names(a.folder, b.folder)
    differing = [one.key for one in found if one.differs]
    verb = "differs" if len(differing) == 1 else "differ"
    lines = [f"{', '.join(differing)}: {verb} by more than chance" if differing else
             "no figure differs by more than chance",
             f"{found[0].test}; two-sided, p adjusted by Holm, level {LEVEL:g}; {names[0]}: "
             f"{counted(len(a.rows), 'run')}, {names[1]}: {counted(len(b.rows), 'run')}"]
    lines += [f"{one.key}: {one.missing} runs have no such figure" for one in found if one.missing]
    plots = [{"kind": "two", "title": one.key, "x": one.key, "y": "runs", "note": one.in_words(), "min": None,
              "max": None, "groups": [{"label": name, "values": [value for value in campaign.values(one.key)
                                                                 if isfinite(value)]}
                                      for name, campaign in zip(names, (a, b), strict=True)]} for one in found[1:]]
    return Comparison(f"{names[0]} and {names[1]}", ["figure", names[0], names[1], "p", ""],
                      [_row(one, share=place == 0) for place, one in enumerate(found)], lines, plots)


def _row(one: Difference, *, share: bool) -> list[str]:
    return [one.key, estimate(one.a, share), estimate(one.b, share), f"{one.p:.3g}" if isfinite(one.p) else "",
            one.in_words()]


def _runs(a: Path, b: Path) -> Comparison:
    names, runs = _names(a, b), (load_run(a), load_run(b))
    of_a, of_b = ({verdict.key: verdict.value for verdict in verdicts_of(run)} for run in runs)
    rows = []
    for key in dict.fromkeys([*of_a, *of_b]):
        values = [nan if (value := of.get(key)) is None else value for of in (of_a, of_b)]
        rows.append([key, *(number(value) if isfinite(value) else "no value" for value in values),
                     number(values[1] - values[0]) if isfinite(values[1] - values[0]) else ""])
    hashes = [str(run.summary.get("ledger_hash", "")) for run in runs]
    same = bool(hashes[0]) and hashes[0] == hashes[1]
    lines = [f"{_about(name, run)}, ledger {hash_ or 'unknown'}" for name, run, hash_ in
             zip(names, runs, hashes, strict=True)]
    lines.append("the ledgers are equal: every frame copy has the same times and fate" if same else
                 "the ledgers differ")
    return Comparison(f"{names[0]} and {names[1]}", ["figure", names[0], names[1], "difference"], rows, lines,
                      _overlaid(runs, names))


def _about(name: str, run: RunData) -> str:
    return f"{name}: {run.scenario.get('name', '?')}, seed {run.scenario.get('seed', '?')}, {run.length_ns * 1e-9:g} s"


def _overlaid(runs: tuple[RunData, RunData], names: tuple[str, str]) -> list[Json]:
    """Return a plot for each signal that both runs have, that of the question first; curves of a node have its hue."""
    plots = []
    for entry in overlaid(question_first(runs[0]), question_first(runs[1]), names):
        if len({curve["run"] for curve in entry["curves"]}) < 2:
            continue
        own = [curve["label"].partition(": ")[2] for curve in entry["curves"]]
        hues = {label: place for place, label in enumerate(dict.fromkeys(own))}
        unit = "-" if entry["unit"] == "1" else entry["unit"]
        plots.append({"kind": "runs", "title": entry["name"], "x": "time [s]", "y": f"{entry['name']} [{unit}]",
                      "note": f"solid: {names[0]}, dotted: {names[1]}", "min": None, "max": None,
                      "curves": [curve | {"hue": hues[label]} for curve, label in
                                 zip(entry["curves"], own, strict=True)]})
    return plots


def _names(a: Path, b: Path) -> tuple[str, str]:
    """Return the names of two folders, with so many of their parents that they differ."""
    parts_a, parts_b = a.absolute().parts, b.absolute().parts
    for depth in range(1, max(len(parts_a), len(parts_b)) + 1):
        names = "/".join(parts_a[-depth:]), "/".join(parts_b[-depth:])
        if names[0] != names[1]:
            return names
    return f"A: {a.name}", f"B: {b.name}"
