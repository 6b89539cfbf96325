"""`report.html`: a run on one page that opens without a network, from the run folder alone.

The page has the numbers once, as JSON, and draws them with Plotly (see `plotly_file`). Curves of more than 5 000 points
keep the extremes of each stretch (see `thinning`); a note tells the reader of each curve that is thinned or cut. The
page of an aborted run names the cause and the missing records.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import msgspec
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from experiments.judge.frame_copies import LedgerUnreadable
from experiments.judge.metrics import evaluate
from experiments.judge.monitors.judge import VIOLATED
from experiments.judge.monitors.outcome import Standing
from experiments.judge.round_trips import round_trips
from experiments.judge.run_data import RunData, load_run
from experiments.judge.run_result import Verdict
from experiments.show.report import series
from experiments.show.report.event_tables import event_tables, told
from experiments.show.report.facts import facts, failure_of, milliseconds, seconds, unfinished, windows
from experiments.show.report.lateness import lateness
from experiments.show.report.marks import Told, instants_ns, marks
from experiments.show.report.modes import Stay, stay_tables, stays
from experiments.show.report.modes import for_page as modes_for_page
from experiments.show.report.moments import Moments, moments
from experiments.show.report.palette import FATES, for_page
from experiments.show.report.plane import plane
from experiments.show.report.plotly_file import Where, plotly_source, shared_plotly
from experiments.show.report.question_first import no_such_signal, question_first
from experiments.show.report.records_list import RecordFile, record_files
from experiments.show.report.series import Json
from netem.core.fate import Fate
from netem.records.events import Event
from netem.records.part_file import write_whole
from netem.wire.level import Level

PAGE = files("experiments.show.report") / "page"
MOST_EVENTS = 300
MOST_OF_A_KIND = 30
FEW_OF_A_KIND = 3           # events listed of a frequent kind below WARNING, so that others stay visible

KIND_NAMES = {"guarantee": "guarantee violated", "assumption": "assumption violated", "warning": "warning",
              "expectation": "expectation broken"}


class Limits(NamedTuple):
    """A bound of an expectation, as in the resolved scenario."""

    min: float | None
    max: float | None
    during_ns: tuple[int, int] | None = None
    formula: str = ""
    links: Mapping[str, Sequence[tuple[str, str, str]]] = MappingProxyType({})
    share: float | None = None


def write_report(run_dir: Path, plotly: Where = "auto") -> Path:
    """Write `report.html` and return its path.

    `plotly` is the place of the drawing library: "inside" the page, "beside" the run folder in a file that reports
    share, or "auto": beside if the folder of another run is there.
    """
    path = run_dir / "report.html"
    data, address = load_run(run_dir), shared_plotly(run_dir, plotly)
    try:
        page = render(data, run_dir, address)
    except LedgerUnreadable as error:
        page = render(data.without_ledger(str(error)), run_dir, address)
    write_whole(path, page.encode())
    return path


def render(data: RunData, run_dir: Path, plotly_address: str | None = None) -> str:
    verdicts = verdicts_of(data)
    broke = moments(data, verdicts)
    events, in_modes = told(data), stays(data)
    drawn = _drawn(data, broke, events, in_modes)
    listed = [event for event in data.events if event.kind != VIOLATED or not data.guarantees]
    guarantees = [outcome.standing for outcome in data.guarantees.values()]
    broken = [verdict for verdict in verdicts if not verdict.holds]
    records = record_files(run_dir)
    environment = Environment(loader=PackageLoader("experiments.show.report", "page"), autoescape=True,
                              undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= {"number": number, "seconds": seconds, "size": size, "code": code, "explained": explained,
                            "milliseconds": milliseconds}
    return environment.get_template("report.html.j2").render(
        name=data.scenario.get("name") or run_dir.absolute().name, question=data.scenario.get("question") or "",
        verdicts=verdicts, broken=broken, missing=data.missing,
        notes=[note for note in (no_such_signal(data), *data.summary.get("warnings", ())) if note],
        failure=failure_of(data), reached_ns=data.length_ns,
        windows=windows(data), unfinished=unfinished(data), facts=facts(data), drawn=drawn,
        round_trips=round_trips(data),
        table=series.node_table(data), stay_tables=stay_tables(data, in_modes), event_tables=event_tables(events),
        guarantees=guarantees, moments=broke, kind_names=KIND_NAMES,
        fates_shown=[(fate.value, fate.meaning, *FATES[fate]) for fate in Fate
                     if any(fate.value in link["fates"] for link in drawn["fates"])],
        contents=_contents(verdicts, broken, guarantees, len(broke.shown), drawn, records, bool(events)),
        events=listed_events(listed), event_total=len(listed), level_name=level_name, records=records,
        event_kinds=sorted(Counter(event.kind for event in data.events).items()),
        data_json=_for_script(drawn), plotly_address=plotly_address,
        plotly=None if plotly_address else Markup(plotly_source()), script=_script(), style=_text(PAGE / "report.css"))


def _drawn(data: RunData, broke: Moments, events: Told, in_modes: Sequence[Stay]) -> Json:
    """Return the data that the page's script draws."""
    shown_ns = [*broke.instants_ns, *instants_ns(events, [stay.from_ns for stay in in_modes])]
    return {"signals": question_first(data), "switching": series.switching(data), "violated": series.violated(data),
            "faulty": series.faulty(data),
            "spoken": series.spoken(data, broke.instants_ns), "fates": series.fates(data), "ages": series.ages(data),
            "gaps": series.gaps(data), "nodes": data.nodes, "plane": plane(data, shown_ns),
            "modes": modes_for_page(data, in_modes), "lateness": lateness(data),
            "marks": marks(events, data.length_ns, data.run.get("dead_ns") or {}),
            "length_s": data.length_ns * 1e-9, "palette": for_page(),
            "meanings": {fate.value: fate.meaning for fate in Fate}, "delivered": Fate.DELIVERED.value,
            "charts": data.charts,
            "moments": [{"t_s": moment.from_ns / 1e9, "words": f"{moment.what}, {moment.on}"}
                        for moment in broke.shown if moment.from_ns is not None]}


def _contents(verdicts: Sequence[Verdict], broken: Sequence[Verdict], guarantees: Sequence[Standing], broke: int,
              drawn: Json, records: Sequence[RecordFile], told_any: bool) -> list[tuple[str, str, str, bool]]:
    """Return the entries of the contents: (id of the section, name, note, True if the note is about a failure)."""
    unmet = sum(not standing.as_expected for standing in guarantees)
    shown: list[tuple[bool, str, str, str, bool]] = [
        (True, "top", "Result", "", False),
        (bool(verdicts), "expectations", "Expectations", f"✗ {len(broken)}" if broken else "✓", bool(broken)),
        (bool(guarantees), "guarantees", "Guarantees", f"✗ {unmet}" if unmet else "✓", bool(unmet)),
        (bool(broke), "broke", "What broke, and when", str(broke), False),
        (True, "signals", "Signals over time", "", False),
        (bool(drawn["plane"]), "plane", "In the plane", "", False),
        (bool(drawn["modes"]), "modes", "Modes over time", "", False),
        (told_any, "told", "Events as tables", "", False),
        (bool(drawn["charts"]), "charts", "Made before the run", "", False),
        (True, "spoken", "Who spoke when", "", False),
        (True, "fates", "Fates by link", "", False),
        (True, "ages", "Age of information", "", False),
        (True, "gaps", "Time between transmissions", "", False),
        (bool(drawn["lateness"]), "lateness", "Lateness", "", False),
        (True, "nodes", "Nodes", "", False),
        (True, "events", "Events", "", False),
        (bool(records), "records", "Records", "", False),
    ]
    return [entry for there, *entry in shown if there]  # type: ignore[misc]


def listed_events(events: Sequence[Event]) -> list[Event]:
    """Return the first events of each kind, in order; only a few of a frequent kind below WARNING."""
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
    """Return the verdicts in the summary or, if it has none, those computed from the scenario's `expect`."""
    recorded = data.summary.get("verdicts")
    if recorded:
        return msgspec.convert(recorded, list[Verdict])
    expect = {key: Limits(bound.get("min"), bound.get("max"), bound.get("during_ns"),
                          bound.get("formula", ""), bound.get("links", {}), bound.get("share"))
              for key, bound in (data.scenario.get("expect") or {}).items()}
    return evaluate(expect, data)


def number(value: float | None) -> str:
    """Return five significant digits, "" for an absent bound."""
    return "" if value is None else f"{value:.5g}"


def level_name(level: int) -> str:
    return Level(level).name.lower()


def size(size_bytes: int) -> str:
    """Return a size in the unit that leaves one to three digits before the point: 987 B, 1.2 MB, 345 kB."""
    value, unit = float(size_bytes), "B"
    for larger in ("kB", "MB", "GB"):
        if value < 999.5:
            break
        value, unit = value / 1000, larger
    return f"{value:.0f} {unit}" if unit == "B" or value >= 99.95 else f"{value:.1f} {unit}"


def code(text: str) -> Markup:
    """Return `text` with the words between backticks as code."""
    parts = [escape(part) for part in text.split("`")]
    return Markup("").join(Markup("<code>{}</code>").format(part) if k % 2 else part for k, part in enumerate(parts))


def explained(text: str) -> Markup:
    """Return `text` with the meaning of its first fate, if any, as a tooltip."""
    for fate in sorted(Fate, key=lambda fate: -len(fate.value)):
        before, found, after = text.partition(f" {fate.value}")
        if found:
            return Markup('{} <abbr title="{}">{}</abbr>{}').format(before, fate.meaning, fate.value, after)
    return escape(text)


def _script() -> Markup:
    """Return the page's script: its files in the order of their names."""
    return Markup("\n").join(_text(part) for part in sorted((PAGE / "script").iterdir(), key=lambda part: part.name)
                             if part.name.endswith(".js"))


def _text(resource: Traversable) -> Markup:
    return Markup(resource.read_text("utf-8"))


def _for_script(content: Any) -> Markup:
    """Return `content` as JSON that cannot end the script element around it."""
    return Markup(msgspec.json.encode(content).decode().replace("<", "\\u003c"))
