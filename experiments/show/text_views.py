"""Prints scenarios, the figures of a run, plants and tables of results; it computes no figure itself."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.judge.run_result import by_fate, lateness_in_words
from experiments.show.console import print_table

if TYPE_CHECKING:
    from experiments.judge.run_result import Summary, Verdict
    from experiments.scenario import Scenario
    from experiments.show.console import Console
    from experiments.show.tables import Measured
    from fmus.description import PlantDescription
    from fmus.presets import Preset


def print_scenario(console: Console, scenario: Scenario) -> None:
    console.print(f"{scenario.name}: {scenario.question or 'asks no question'}", soft_wrap=True)
    print_table(console, ["", ""], [
        ("robot time", f"{scenario.length_ns * 1e-9:g} s"), ("seed", str(scenario.seed)),
        ("samples", f"every {scenario.sample_period_ns * 1e-9:g} s" if scenario.sample_period_ns else "none")])
    console.print()
    print_table(console, ["agent", "program", "plant", "clock", "media"], [
        (agent.name, agent.program, agent.plant.fmu if agent.plant else "-",
         "ideal" if agent.clock == type(agent.clock)() else
         f"{agent.clock.offset_ns * 1e-9:+g} s {agent.clock.drift_ppm:+g} ppm tick {agent.clock.tick_ns * 1e-9:g} s",
         " ".join(agent.media)) for agent in scenario.agents.values()])
    console.print()
    print_table(console, ["medium", "kind", "nodes"],
                [(medium.name, medium.kind, " ".join(medium.nodes)) for medium in scenario.media.values()])
    for medium in scenario.media.values():
        for shown in medium.settings.shown(medium.name, medium.nodes):
            console.print()
            console.print(shown.title, soft_wrap=True)
            print_table(console, shown.columns, shown.rows)
    _section(console, ["impairment", "kind", "on", "links", "during"], [
        (spec.called, spec.kind, spec.on, str(len(spec.links)),
         ", ".join(f"{start * 1e-9:g}-{end * 1e-9:g} s" for start, end in spec.windows_ns) or "the whole run")
        for spec in scenario.impairments])
    _section(console, ["guarantee", "kind", "on", "watched", "expected"], [
        (name, item.kind, item.on, str(len(item.subjects)),
         "; ".join(filter(None, ("to hold" if item.expected == "holds" else "violated", _of_runs(item.share)))))
        for name, item in scenario.guarantees.items()])
    _section(console, ["expected", "at least", "at most", ""],
             [(key, _number(bound.min), _number(bound.max),
               "; ".join(filter(None, (" ".join(bound.formula.split()), _of_runs(bound.share)))))
              for key, bound in scenario.expect.items()])


def print_summary(console: Console, summary: Summary) -> None:
    print_table(console, ["", ""], [
        ("scenario", summary.scenario), ("seed", str(summary.seed)), ("host", summary.host),
        ("robot time", f"{summary.length_ns * 1e-9:g} s"),
        *([("ended", summary.ended)] if summary.ended else []),
        *([("fates", summary.replay)] if summary.replay else []),
        ("wall time", f"{summary.wall_s:.2f} s, {summary.start_up_s:.2f} s to start before"),
        ("real-time factor", f"{summary.real_time_factor:.1f}"),
        ("windows, grants", f"{summary.windows}, {summary.grants}"),
        ("frame copies", by_fate(summary.frames)), ("ledger hash", summary.ledger_hash),
        ("code", summary.code),
        *([("lateness", lateness_in_words(summary.real_time))] if summary.real_time else [])])
    _section(console, ["guarantee", "requires", "on", "worst", "margin", ""], [
        (item.name, item.requires, item.on, _quantity(item.worst, item.unit), _quantity(item.margin, item.unit),
         item.in_words()) for item in summary.guarantees])
    _section(console, ["expected", "value", "at least", "at most", ""], [
        (verdict.key, _quantity(verdict.value, verdict.unit), _number(verdict.min), _number(verdict.max),
         _judged(verdict)) for verdict in summary.verdicts])


def _of_runs(share: float | None) -> str:
    return "" if share is None else f"expected of {100 * share:.4g} % of a campaign's runs"


def _judged(verdict: Verdict) -> str:
    if verdict.share is not None:
        return f"{f'beyond: {how}' if (how := verdict.by_how_much()) else 'within'}; {_of_runs(verdict.share)}"
    if not verdict.holds:
        return f"DOES NOT HOLD: {verdict.by_how_much()}"
    return f"holds, {verdict.decided()}" if verdict.decided() else "holds"


def print_plant(console: Console, plant: PlantDescription) -> None:
    fixed = f"steps of {plant.fixed_step_s} s" if plant.fixed_step_s else "one step size"
    step = "steps of any size" if plant.variable_step else fixed
    console.print(f"{plant.model_name}: {plant.about}", soft_wrap=True)
    console.print(f"{plant.file}: FMI {plant.fmi}, {step}", soft_wrap=True)
    console.print()
    print_table(console, ["variable", "kind", "type", "unit", "start", "about"], [
        (item.name, item.causality, item.type, item.unit or "", item.start or "", item.about)
        for item in plant.variables.values()])


def print_presets(console: Console, presets: Mapping[str, Preset]) -> None:
    _section(console, ["preset", "about", "values"], [
        (name, preset.about, ", ".join(f"{key} = {value}" for key, value in preset.parameters.items()))
        for name, preset in presets.items()])


def print_measured(console: Console, values: Iterable[Measured]) -> None:
    rows = []
    for value in values:
        row, error = value.row, value.standard_error
        ours = "not installed" if value.ours is None else f"{value.ours:.4f}"
        quantity = row.quantity if row.unit == "1" else f"{row.quantity} [{row.unit}]"
        rows.append((row.what, quantity, _number(row.printed, ".4f"), ours,
                     "" if error is None else f"+- {error:.4f}", _range(row.low, row.high),
                     _number(row.printed_variance, ".2g"), _number(value.variance, ".2g"),
                     {True: "met", False: "MISSED", None: "not judged"}[value.met]
                     + (", not reproduced" if row.reproduced is False else "")))
    columns = ["", "", "printed", "ours", "s.e.", "band", "variance printed", "ours", "ours, printed"]
    shown = [at for at in range(len(columns)) if any(row[at] not in ("", "-") for row in rows)]
    print_table(console, [columns[at] for at in shown], [[row[at] for at in shown] for row in rows])


def _section(console: Console, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table below an empty line; nothing if it has no rows."""
    if rows:
        console.print()
        print_table(console, columns, rows)


def print_path(console: Console, what: str, path: Path) -> None:
    """Print a path on one line, also on a narrow terminal, so that it can be clicked or copied."""
    console.print(f"{what}: {path}", soft_wrap=True)


def _range(low: float | None, high: float | None) -> str:
    if low is None:
        return "-" if high is None else f"at most {high:g}"
    return f"at least {low:g}" if high is None else f"{low:.4g} to {high:.4g}"


def _quantity(value: float | None, unit: str) -> str:
    return f"{_number(value)} {unit}".strip() if value is not None else "-"


def _number(value: float | None, form: str = ".6g") -> str:
    return "-" if value is None else format(value, form)
