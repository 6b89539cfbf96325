"""Runs a scenario from Python, and reads the records of the run."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Literal

from experiments.judge.run_data import RunData, load_run
from experiments.judge.run_files import LEDGER
from experiments.judge.run_result import Summary, Verdict
from experiments.run.repeat import MadeWith
from marconet.scenario import Scenario, load

if TYPE_CHECKING:
    import polars as pl

GET_POLARS = "data frames need polars: pip install 'marconet[frames]'"


class Run:
    """A run that has ended. `folder` holds its records (docs/records.md)."""

    def __init__(self, folder: Path, summary: Summary) -> None:
        self.folder = folder
        self._summary = summary

    @property
    def holds(self) -> bool:
        """Whether the run has not failed and every expectation holds."""
        return self._summary.holds

    @property
    def ledger_hash(self) -> str:
        """Hash of the ledger, equal for the same scenario and seed on every machine and host."""
        return self._summary.ledger_hash

    @property
    def warnings(self) -> list[str]:
        return list(self._summary.warnings)

    @cached_property
    def expectations(self) -> pl.DataFrame:
        """One row for each figure of `[expect]`: key, value, min, max, holds, and why it has no value.

        For a formula, `value` is its robustness, and there are `formula`, `unit`, `at_ns`, `predicate` and `subject`:
        the instant and the comparison that decide it, and the link or signal that counts there. With a `share` a single
        run holds, also if it is `beyond` its bound.
        """
        verdicts = self._summary.verdicts
        polars = _polars()
        frame: pl.DataFrame = polars.DataFrame(
            {"key": [verdict.key for verdict in verdicts], "value": [verdict.value for verdict in verdicts],
             "min": [verdict.min for verdict in verdicts], "max": [verdict.max for verdict in verdicts],
             "holds": [verdict.holds for verdict in verdicts], "why": [verdict.why for verdict in verdicts],
             "formula": [verdict.formula for verdict in verdicts], "unit": [verdict.unit for verdict in verdicts],
             "at_ns": [verdict.at_ns for verdict in verdicts],
             "predicate": [verdict.predicate for verdict in verdicts],
             "subject": [verdict.subject for verdict in verdicts],
             "share": [verdict.share for verdict in verdicts], "beyond": [verdict.beyond for verdict in verdicts]},
            schema={"key": polars.String, "value": polars.Float64, "min": polars.Float64, "max": polars.Float64,
                    "holds": polars.Boolean, "why": polars.String, "formula": polars.String, "unit": polars.String,
                    "at_ns": polars.Int64, "predicate": polars.String, "subject": polars.String,
                    "share": polars.Float64, "beyond": polars.Boolean})
        return frame

    @cached_property
    def ledger(self) -> pl.DataFrame:
        """One row for each frame copy, with the columns of docs/records.md."""
        from netem.records.ledger_file import read_ledger

        frame: pl.DataFrame = _polars().from_arrow(read_ledger(self.folder / LEDGER))
        return frame

    @cached_property
    def signals(self) -> Mapping[str, pl.DataFrame]:
        """For each node and table of derived signals: a frame with `time_ns` and a column for each signal."""
        polars = _polars()
        return {node: polars.DataFrame({"time_ns": table.time_ns} |
                                       {name: table.column(name) for name in table.names})
                for node, table in self._data.signals.items()}

    @cached_property
    def units(self) -> Mapping[str, Mapping[str, str]]:
        """For each node, the unit of each signal, "1" for a pure number."""
        return {node: dict(zip(table.names, table.units, strict=True)) for node, table in self._data.signals.items()}

    @cached_property
    def events(self) -> pl.DataFrame:
        """One row for each event, by time: time_ns, node ("" for the emulator), kind, detail, level."""
        polars = _polars()
        events = self._data.events
        frame: pl.DataFrame = polars.DataFrame(
            {"time_ns": [event.time_ns for event in events], "node": [event.node for event in events],
             "kind": [event.kind for event in events], "detail": [event.detail for event in events],
             "level": [event.level.name.lower() for event in events]},
            schema={"time_ns": polars.Int64, "node": polars.String, "kind": polars.String, "detail": polars.String,
                    "level": polars.String})
        return frame

    @property
    def counters(self) -> Mapping[str, Mapping[str, int]]:
        """For each node, the counters of its program at the end of the run."""
        return self._data.counters

    def report(self) -> Path:
        """Path of the run's report.html, which the first call writes."""
        from experiments.show.report.build import write_report

        page = self.folder / "report.html"
        return page if page.exists() else write_report(self.folder)

    def first_violation(self) -> str:
        """Describe the failure of the run, or else its first violated expectation with its instant; "" if it holds."""
        if self._summary.failure:
            return self._summary.failure
        broken = [verdict for verdict in self._summary.verdicts if not verdict.holds]
        return self._in_words(broken[0]) if broken else ""

    def repeat(self) -> str:
        """The command that repeats the run, if its scenario is a file."""
        real_time = [] if self._summary.real_time is None else ["--real-time"]
        scenario = self._data.scenario
        made = MadeWith(Path(scenario["path"]), scenario["changes"] | {"seed": self._summary.seed})
        return shlex.join([*made.words(), "--host", self._summary.host, *real_time])

    @cached_property
    def _data(self) -> RunData:
        return load_run(self.folder)

    def _in_words(self, verdict: Verdict) -> str:
        from experiments.show.report.instants import instant_of

        bound = self._data.scenario.get("expect", {}).get(verdict.key) or {}
        during = bound.get("during_ns")
        instant = instant_of(verdict, None if during is None else (during[0], during[1]), self._data)
        where = "" if instant is None else f" (t = {instant.time_ns * 1e-9:.9g} s: {instant.words})"
        value = "no value" if verdict.value is None else f"{verdict.value:.6g}"
        return f"{verdict.key} is {value}: {verdict.by_how_much()}{where}"

    def __repr__(self) -> str:
        judged = "holds" if self.holds else self.first_violation()
        return (f"<marconet.Run of {self._summary.scenario}, seed {self._summary.seed}: {judged}; records in "
                f"{self.folder}; repeat with {self.repeat()}>")

    def _repr_html_(self) -> str:
        """HTML for a notebook: a picture of the signals that the report shows first, and a table of the verdicts."""
        from markupsafe import escape

        from experiments.show.report.picture import draw

        rows = "".join(f"<tr><td><code>{escape(verdict.key)}</code></td><td>{_short(verdict.value)}</td>"
                       f"<td>{'holds' if verdict.holds else escape(verdict.by_how_much())}</td></tr>"
                       for verdict in self._summary.verdicts)
        return (f"<p><b>{escape(self._summary.scenario)}</b>, seed {self._summary.seed}: "
                f"{'holds' if self.holds else 'does not hold'}; records in <code>{escape(str(self.folder))}</code></p>"
                f"{draw(self._data)}<table>{rows}</table>")


def fault(run: str | Path, kind: str, **keys: Any) -> tuple[str, float]:
    """Inject a fault, with the keys of `[[faults]]`, into the run in real time in the folder `run`; it begins at once.

    Returns its name and its instant in s of the run. Raises ValueError with the reason if it cannot be injected.
    """
    from experiments.run.injection import inject

    name, at_ns = inject(Path(run), kind, keys)
    return name, at_ns / 1e9


def run(scenario: Scenario | str | PurePath, *, host: Literal["inline", "process"] = "process",
        out: str | PurePath | None = None, report: bool = False, real_time: bool = False, rate: float | None = None,
        overwrite: bool = False) -> Run:
    """Run a scenario, given by name, path or `Scenario`, and return the run when it has ended.

    `host`: "process" runs each robot in a process of its own, "inline" runs all robots in this process. `out` is the
    folder of the records, by default a new one below ./runs; `overwrite` replaces the records of an earlier run there.
    `real_time` runs at the pace of the wall clock; `rate` does so at that many virtual seconds per second.

    Raises NodeFailure if a robot's program fails, after writing the records up to then, and ValueError if `out` holds
    another run or the scenario needs another host. A violated expectation raises nothing: see `Run.holds`.
    """
    from experiments.run.runner import run as run_scenario
    from experiments.scenario.real_time import at_rate

    checked = (scenario if isinstance(scenario, Scenario) else load(scenario)).checked
    if rate is not None:
        checked = at_rate(checked, rate)
    result = run_scenario(checked, host=host, out=None if out is None else Path(out), report=report,
                          real_time=real_time or rate is not None, overwrite=overwrite)
    return Run(result.folder, result.summary)


def _polars() -> Any:
    try:
        import polars
    except ImportError as error:
        raise ImportError(GET_POLARS) from error
    return polars


def _short(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"
