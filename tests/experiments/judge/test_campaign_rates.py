"""Rates of kept bounds against the binomial distribution itself, and what they show of an expected share."""

from pathlib import Path

import pytest
from scipy.stats import binom

from experiments.judge.campaign import Campaign, Plan, Row
from experiments.judge.campaign_rates import Showing, fewest_runs, holds, not_shown, rates
from experiments.judge.figures import Figures
from experiments.scenario.model import Bound


def campaign(*runs, share=None, settings=1):
    """One row for each of `runs`: "kept", "broken" or "failed"; those of a setting are next to each other."""
    seeds = tuple(range(len(runs) // settings))
    plan = Plan("s", "", "s.toml", "", None, (), {}, ("k",), tuple({"k": k} for k in range(settings)), seeds, "inline",
                {"x": Bound(min=0.0, share=share)})
    rows = [Row(number, number // len(seeds), Figures(
        number % len(seeds), "h", run == "kept" or (run == "broken" and share is not None),
        {} if run == "failed" else {"x": 1.0}, ["x"] if run == "broken" else [], "no fuel" if run == "failed" else ""))
        for number, run in enumerate(runs)]
    return Campaign(Path("c"), plan, rows)


@pytest.mark.parametrize(("kept", "runs"), [(0, 20), (17, 20), (20, 20), (1000, 1000)])
def test_the_interval_ends_where_as_much_or_more_has_a_probability_of_a_fortieth(kept, runs):
    rate, = rates(campaign(*["kept"] * kept, *["broken"] * (runs - kept)))

    low, high = rate.estimate.low, rate.estimate.high
    assert (rate.kept, rate.runs) == (kept, runs)
    assert (binom.sf(kept - 1, runs, low) if kept else low) == pytest.approx(0.025 if kept else 0.0, rel=1e-6)
    assert (binom.cdf(kept, runs, high) if kept < runs else high) == pytest.approx(0.025 if kept < runs else 1.0,
                                                                                  rel=1e-6)


def test_a_run_that_failed_keeps_nothing_and_each_setting_is_told_apart():
    found = campaign("kept", "failed", "kept", "kept", settings=2)

    assert [(rate.setting, rate.kept, rate.runs) for rate in rates(found)] == [(0, 1, 2), (1, 2, 2)]


@pytest.mark.parametrize(("kept", "broken", "showing", "words"), [
    (36, 0, Showing.SHOWN, "at least 90 %: shown"),
    (35, 0, Showing.UNDECIDED, "at least 90 %: undecided, which takes 36 runs or more"),
    (57, 3, Showing.UNDECIDED, "at least 90 %: undecided, more seeds decide"),
    (10, 10, Showing.REFUTED, "at least 90 %: refuted"),
])
def test_a_share_is_shown_by_the_lower_end_and_refuted_by_the_upper_one(kept, broken, showing, words):
    found = campaign(*["kept"] * kept, *["broken"] * broken, share=0.9)

    rate, = rates(found)

    assert (rate.showing, rate.in_words()) == (showing, words)
    assert [rate.key for rate in not_shown(found)] == ([] if showing is Showing.SHOWN else ["x"])
    assert holds(found) == (showing is Showing.SHOWN)


def test_without_a_share_every_run_has_to_keep_it():
    assert holds(campaign("kept", "kept"))
    assert not holds(campaign("kept", "broken"))
    assert [rate.in_words() for rate in rates(campaign("kept", "broken"))] == [""]


def test_a_run_that_failed_breaks_a_campaign_whose_share_is_shown():
    assert not holds(campaign(*["kept"] * 99, "failed", share=0.5))


@pytest.mark.parametrize("share", [0.01, 0.5, 0.9, 0.999])
def test_so_many_runs_show_a_share_and_one_less_does_not(share):
    n = fewest_runs(share)

    enough, too_few = campaign(*["kept"] * n, share=share), campaign(*["kept"] * (n - 1), share=share)

    assert holds(enough)
    assert n == 1 or not holds(too_few)
