"""`report.html`: a run on one page that opens without a network, from the run folder alone.

The page carries the numbers once, as JSON, and draws them with the Plotly that is installed; nothing is fetched. Curves
of more than 5 000 points keep the extremes of each stretch (see `thinning`); what is thinned or cut is said beside it.
A folder of a run that was broken off gives a page that says what is missing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from experiments.frame_copies import LedgerUnreadable
from experiments.metrics import evaluate
from experiments.monitors.judge import VIOLATED
from experiments.report import series
from experiments.report.plane import plane
from experiments.run_data import RunData, load_run
from experiments.run_result import Verdict, lateness_in_words
from netem.records.events import Event, Level

PAGE = files("experiments.report") / "page"
MOST_EVENTS = 300
MOST_OF_A_KIND = 30
FEW_OF_A_KIND = 3           # of what a program tells at every step, so that it hides nothing else
MOST_VIOLATIONS = 60


class Limits(NamedTuple):
    """A bound as a scenario file has it."""

    min: float | None
    max: float | None
    during_ns: tuple[int, int] | None = None


def write_report(run_dir: Path) -> Path:
    data = load_run(run_dir)
    path = run_dir / "report.html"
    try:
        page = render(data, run_dir.name)
    except LedgerUnreadable as error:
        page = render(data.without_ledger(str(error)), run_dir.name)
    path.write_text(page, encoding="utf-8")
    return path


def render(data: RunData, folder: str) -> str:
    verdicts = verdicts_of(data)
    drawn = {"signals": series.signals(data), "switching": series.switching(data),
             "violated": series.violated(data), "spoken": series.spoken(data),
             "fates": series.fates(data), "ages": series.ages(data), "gaps": series.gaps(data), "nodes": data.nodes,
             "plane": plane(data),
             "length_s": data.length_ns * 1e-9}
    listed = [event for event in data.events if event.kind != VIOLATED or not data.guarantees]
    environment = Environment(loader=PackageLoader("experiments.report", "page"), autoescape=True,
                              undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= {"number": number, "seconds": seconds}
    return environment.get_template("report.html.j2").render(
        name=data.scenario.get("name") or folder, question=data.scenario.get("question") or "", verdicts=verdicts,
        broken=[verdict for verdict in verdicts if not verdict.holds], missing=data.missing,
        windows=windows(data), unfinished=unfinished(data), facts=facts(data), drawn=drawn,
        table=series.node_table(data),
        guarantees=[outcome.standing for outcome in data.guarantees.values()],
        violations=[(outcome.standing, outcome.violations[:MOST_VIOLATIONS]) for outcome in data.guarantees.values()
                    if outcome.violations],
        events=listed_events(listed), event_total=len(listed), level_name=level_name,
        event_kinds=sorted(Counter(event.kind for event in data.events).items()),
        data_json=_for_script(drawn), plotly=_text(files("plotly") / "package_data" / "plotly.min.js"),
        script=_text(PAGE / "report.js"), style=_text(PAGE / "report.css"))


def listed_events(events: Sequence[Event]) -> list[Event]:
    """The first of each kind, in order: of many that are no warnings a few are enough."""
    told = Counter(event.kind for event in events)
    seen: Counter[str] = Counter()
    shown = []
    for event in events:
        seen[event.kind] += 1
        chatter = told[event.kind] > MOST_OF_A_KIND and event.level < Level.WARNING
        if seen[event.kind] <= (FEW_OF_A_KIND if chatter else MOST_OF_A_KIND):
            shown.append(event)
    return shown[:MOST_EVENTS]


def verdicts_of(data: RunData) -> list[Verdict]:
    """The run's own verdicts, or where it left none those on the scenario's `expect`."""
    recorded = data.summary.get("verdicts")
    if recorded:
        return msgspec.convert(recorded, list[Verdict])
    expect = {key: Limits(bound.get("min"), bound.get("max"), bound.get("during_ns"))
              for key, bound in (data.scenario.get("expect") or {}).items()}
    return evaluate(expect, data)


def windows(data: RunData) -> dict[str, str]:
    """Of the expectations that judge a part of the run, which: "[2, 4) s"."""
    return {key: f"[{', '.join(f'{time_ns * 1e-9:g}' for time_ns in bound['during_ns'])}) s"
            for key, bound in (data.scenario.get("expect") or {}).items() if bound.get("during_ns")}


def unfinished(data: RunData) -> str:
    meant = data.scenario.get("length_ns")
    if ended := data.run.get("ended"):
        return f"The run ended {ended}; all figures are up to there."
    if isinstance(meant, int) and data.length_ns < meant:
        return f"The run was broken off at {seconds(data.length_ns)} of {seconds(meant)}; all figures are up to there."
    if not data.summary and data.scenario:
        return "The run left no summary: it was broken off, or is still going on."
    return ""


def facts(data: RunData) -> list[tuple[str, str]]:
    """What identifies the run and how it went, as far as it is known."""
    summary, run = data.summary, data.run
    shown: list[tuple[str, Any]] = [
        ("Seed", data.scenario.get("seed", summary.get("seed"))),
        ("Length", seconds(data.length_ns)),
        ("Host", summary.get("host")),
        ("Real-time factor", _times(summary.get("real_time_factor"))),
        ("Lateness", lateness_in_words(run["real_time"]) if run.get("real_time") else None),
        ("Wall clock", f"{summary['wall_s']:.2f} s" if summary.get("wall_s") else None),
        ("Windows", summary.get("windows")),
        ("Grants", summary.get("grants")),
        ("Frame copies", f"{len(data.ledger):,}".replace(",", " ")),
        ("Ledger hash", data.ledger_metadata.get("hash")),
        ("Versions", ", ".join(f"{name} {text}" for name, text in (run.get("versions") or {}).items())),
    ]
    return [(label, str(value)) for label, value in shown if value not in (None, "")]


def _times(factor: float | None) -> str | None:
    return f"{factor:.1f} x real time" if factor else None


def number(value: float | None) -> str:
    """Five significant digits; an open side of a bound is empty."""
    return "" if value is None else f"{value:.5g}"


def seconds(time_ns: int) -> str:
    return f"{time_ns * 1e-9:.9f}".rstrip("0").rstrip(".") + " s"


def level_name(level: int) -> str:
    return Level(level).name.lower()


def _text(resource: Traversable) -> Markup:
    return Markup(resource.read_text("utf-8"))


def _for_script(content: Any) -> Markup:
    """JSON that cannot end the script element it stands in."""
    return Markup(msgspec.json.encode(content).decode().replace("<", "\\u003c"))
