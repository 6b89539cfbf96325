"""Writes the outcomes of scenarios as JUnit XML, which continuous integration servers show as tests.

Each scenario is a suite with a case for each line of `[expect]` and for each guarantee. A scenario without either, or
one that was refused or failed, has the single case `run` or `check`. An expectation or guarantee that does not hold is
a failure; any other problem is an error.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from junitparser import Error, Failure, JUnitXml, TestCase, TestSuite

from experiments.show.outcome import ScenarioOutcome


def write_junit(file: Path, verb: str, outcomes: Iterable[ScenarioOutcome]) -> None:
    """Write `file`, making its folder; `verb`, "run" or "check", names the case of a scenario without others."""
    document = JUnitXml("marconet")
    for outcome in outcomes:
        suite = TestSuite(outcome.scenario)
        for case in _cases(outcome, verb):
            suite.add_testcase(case)
        document.add_testsuite(suite)
    document.update_statistics()        # type: ignore[no-untyped-call]
    file.parent.mkdir(parents=True, exist_ok=True)
    document.write(str(file), pretty=True)


def _cases(outcome: ScenarioOutcome, verb: str) -> Iterable[TestCase]:
    summary = outcome.summary
    asked = [] if summary is None else [
        *((f"expect.{verdict.key}", verdict.holds, verdict.by_how_much()) for verdict in summary.verdicts),
        *((f"guarantees.{item.name}", item.as_expected, item.in_words()) for item in summary.guarantees)]
    wall_s = 0.0 if summary is None else summary.wall_s
    if summary is None or not asked:
        case = TestCase(verb, outcome.scenario, wall_s)
        if outcome.problems:
            case.result = [Error("\n".join(outcome.problems))]
        yield case
    for number, (name, holds, why_not) in enumerate(asked):
        case = TestCase(name, outcome.scenario, 0.0 if number else wall_s)
        if not holds:
            case.result = [Failure(why_not)]
        yield case
