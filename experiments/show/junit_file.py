"""The outcome of scenarios as JUnit XML, which continuous integration servers show as tests.

One suite for each scenario with one case for each line of `[expect]` and for each guarantee; a scenario that asks for
nothing, was refused or failed has the one case `run` or `check`. What does not hold is a failure, everything else that
ended a scenario an error.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from junitparser import Error, Failure, JUnitXml, TestCase, TestSuite

from experiments.show.outcome import ScenarioOutcome


def write_junit(file: Path, verb: str, outcomes: Iterable[ScenarioOutcome]) -> None:
    """`verb` is "run" or "check", the name of the case of a scenario that has no others."""
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
