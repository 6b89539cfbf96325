"""Verdicts in words, and a summary that survives its file."""

from __future__ import annotations

from math import nan

import msgspec
import pytest

from experiments.judge.run_result import Summary, Verdict


@pytest.mark.parametrize(("verdict", "words"), [
    (Verdict("a", 3.0, 1.0, 5.0, True), ""),
    (Verdict("a", 0.5, 1.0, 5.0, False), "0.5 below the least allowed, 1"),
    (Verdict("a", 7.0, 1.0, 5.0, False), "2 above the most allowed, 5"),
    (Verdict("a", 1e-3, None, 1e-4, False), "0.0009 above the most allowed, 0.0001"),
    (Verdict("a", nan, 1.0, None, False), "the run has nothing to measure it by"),
    (Verdict("a", None, 1.0, None, False), "the run has no such figure"),
])
def test_a_verdict_says_by_how_much_it_fails(verdict, words):
    assert verdict.by_how_much() == words


def test_a_summary_holds_if_all_of_its_verdicts_do():
    holds, fails = Verdict("a", 1.0, 0.0, None, True), Verdict("b", 1.0, 2.0, None, False)
    summary = Summary("s", "q?", 7, "inline", 10, 1.0, 0.1, 13.0, 3, 4, "ab", {"lost": 2}, [holds], None)

    assert summary.holds
    assert not msgspec.structs.replace(summary, verdicts=[holds, fails]).holds
    assert msgspec.json.decode(msgspec.json.encode(summary), type=Summary) == summary
