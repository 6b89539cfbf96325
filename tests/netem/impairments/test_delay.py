from __future__ import annotations

from math import pi, sin, sqrt

import numpy as np
import pytest
from scipy import stats

from netem.core.random_streams import stream
from netem.impairments.csv_columns import RecordingError
from netem.impairments.delay import Delay

SIGNIFICANCE = 1e-3
COUNT = 6000
MS = 1_000_000


def delays_ns(delay, transits):
    return np.array([copy.arrival_ns - transit.arrival_ns for transit in transits for copy in delay.carry(transit)])


def pareto(mean_ns, sd_ns):
    """Shape 3 has mean 3/2 and variance 3/4 in units of its scale."""
    scale_ns = sd_ns / sqrt(0.75)
    return stats.pareto(3, loc=mean_ns - 1.5 * scale_ns, scale=scale_ns)


class ParetoNormal:
    """A quarter normal and three quarters Pareto, added at the same probability; the CDF by inverting that sum."""

    def __init__(self, mean_ns, sd_ns):
        self.p = np.concatenate([np.logspace(-12, -3, 4000), np.linspace(1e-3, 1 - 1e-3, 40_000)[1:-1],
                                 1 - np.logspace(-3, -12, 4000)])
        self.x = 0.25 * stats.norm(mean_ns, sd_ns).ppf(self.p) + 0.75 * pareto(mean_ns, sd_ns).ppf(self.p)

    def cdf(self, x):
        return np.interp(x, self.x, self.p)


LAWS = {
    "uniform": lambda mean, width: stats.uniform(mean - width, 2 * width),
    "normal": stats.norm,
    "pareto": pareto,
    "paretonormal": ParetoNormal,
}
laws = pytest.mark.parametrize("distribution", LAWS)


@laws
def test_delays_far_from_zero_follow_their_distribution(distribution, frames):
    delay = Delay(100 * MS, distribution, 10 * MS, rng=stream(7, "delay"))

    found = delays_ns(delay, frames(COUNT))

    assert stats.kstest(found, LAWS[distribution](100 * MS, 10 * MS).cdf).pvalue > SIGNIFICANCE


@laws
@pytest.mark.parametrize("correlation", [0.7, -0.5])
def test_correlation_leaves_the_distribution_as_it_is(distribution, correlation, frames):
    apart = 21                                  # rho^21 < 0.001: what is left of the correlation between those tested
    delay = Delay(100 * MS, distribution, 10 * MS, correlation, rng=stream(7, "delay"))

    found = delays_ns(delay, frames(1500 * apart))[::apart]

    assert (2 * sin(pi * abs(correlation) / 6)) ** apart < 1e-3
    assert stats.kstest(found, LAWS[distribution](100 * MS, 10 * MS).cdf).pvalue > SIGNIFICANCE


@laws
def test_successive_delays_have_the_rank_correlation_asked_for(distribution, frames):
    runs, length, correlation = 30, 1000, 0.7

    found = []
    for run in range(runs):
        x = delays_ns(Delay(100 * MS, distribution, 10 * MS, correlation, rng=stream(run, "delay")), frames(length))
        found.append(stats.spearmanr(x[1:], x[:-1]).statistic)

    bias = (1 + 4 * correlation) / length       # of a lag-1 correlation: Kendall 1954, first order
    assert abs(np.mean(found) - correlation) < bias + 4 * np.std(found, ddof=1) / sqrt(runs)


@pytest.mark.parametrize(("distribution", "pearson"), [
    ("uniform", 0.7),                           # for a uniform law ranks are the values
    ("normal", 2 * sin(pi * 0.7 / 6)),          # the underlying normals themselves
])
def test_linear_correlation_is_the_closed_form(distribution, pearson, frames):
    runs, length = 30, 1000

    found = []
    for run in range(runs):
        x = delays_ns(Delay(100 * MS, distribution, 10 * MS, 0.7, rng=stream(run, "delay")), frames(length))
        found.append(np.corrcoef(x[1:], x[:-1])[0, 1])

    assert abs(np.mean(found) - pearson) < 4 / length + 4 * np.std(found, ddof=1) / sqrt(runs)


@laws
def test_delays_near_zero_are_cut_there_and_keep_their_distribution_above(distribution, frames):
    law = LAWS[distribution](4 * MS, 10 * MS)
    delay = Delay(4 * MS, distribution, 10 * MS, rng=stream(7, "delay"))

    found = delays_ns(delay, frames(COUNT))

    at_zero = float(law.cdf(0))
    assert 0 < at_zero < 0.5
    assert found.min() == 0
    assert abs(np.sum(found == 0) - at_zero * COUNT) < 4 * sqrt(at_zero * (1 - at_zero) * COUNT)
    above = found[found > 0]
    assert stats.kstest(above, lambda x: (law.cdf(x) - at_zero) / (1 - at_zero)).pvalue > SIGNIFICANCE


def test_a_constant_delay_is_exact(frames):
    assert set(delays_ns(Delay(123, rng=stream(7, "delay")), frames(100))) == {123}


def test_jitter_reorders_unless_the_order_is_kept(frames):
    loose, kept = (Delay(10 * MS, "uniform", 9 * MS, keep_order=keep, rng=stream(7, "delay")) for keep in (False, True))

    free = [copy.arrival_ns for transit in frames(300) for copy in loose.carry(transit)]
    ordered = [copy.arrival_ns for transit in frames(300) for copy in kept.carry(transit)]

    assert free != sorted(free)
    assert ordered == list(np.maximum.accumulate(free))


def test_samples_are_drawn_equally_often(frames):
    delay = Delay(1000, "empirical", samples_ns=[5, 30, 5, 80], rng=stream(7, "delay"))

    found = delays_ns(delay, frames(COUNT))

    counts = [int(np.sum(found == value)) for value in (1005, 1030, 1080)]
    assert sum(counts) == COUNT
    assert stats.chisquare(counts, [COUNT / 2, COUNT / 4, COUNT / 4]).pvalue > SIGNIFICANCE


def test_quantiles_are_joined_by_straight_lines(frames):
    delay = Delay(0, "empirical", quantiles_ns=[MS, 2 * MS, 10 * MS], rng=stream(7, "delay"))

    found = delays_ns(delay, frames(COUNT))

    assert stats.kstest(found, lambda x: np.interp(x, [MS, 2 * MS, 10 * MS], [0, 0.5, 1])).pvalue > SIGNIFICANCE


def test_an_empirical_delay_can_be_correlated(frames):
    delay = Delay(0, "empirical", correlation=0.8, quantiles_ns=[MS, 2 * MS, 10 * MS], rng=stream(7, "delay"))

    found = delays_ns(delay, frames(COUNT))

    assert stats.spearmanr(found[1:], found[:-1]).statistic > 0.7


def test_a_file_holds_samples_or_quantiles(tmp_path, frames):
    samples, quantiles = tmp_path / "samples.csv", tmp_path / "quantiles.csv"
    samples.write_text("delay_ms\n0.003\n0.007\n")
    quantiles.write_text("probability,delay_us\n0,1\n0.9,2\n1,100\n")

    sampled = delays_ns(Delay(0, "empirical", file=str(samples), rng=stream(7, "delay")), frames(500))
    drawn = delays_ns(Delay(0, "empirical", file=str(quantiles), rng=stream(7, "delay")), frames(COUNT))

    assert set(sampled) == {3000, 7000}
    below = np.sum(drawn <= 2000)
    assert abs(below - 0.9 * COUNT) < 4 * sqrt(0.09 * COUNT)
    assert drawn.min() >= 1000
    assert drawn.max() <= 100_000


def test_a_files_own_names_are_mapped_and_other_columns_passed_over(tmp_path, frames):
    (tmp_path / "ping.csv").write_text("seq;rtt;ttl\n1;3,5;64\n2;7;64\n")

    delay = Delay(0, "empirical", file=str(tmp_path / "ping.csv"), columns={"delay_us": "rtt"}, rng=stream(7, "delay"))

    assert set(delays_ns(delay, frames(500))) == {3500, 7000}


@pytest.mark.parametrize(("text", "message"), [
    ("lost\n0\n", "none of its columns is known .lost; separated by comma.: expected one of delay_s"),
    ("probability\n0\n1\n", "no column delay_s, delay_ms, delay_us or delay_ns"),
    ("probability,delay_s\n0.1,0\n1,1\n", "expected two or more values that rise from 0 to 1"),
    ("probability,delay_s\n0,2\n1,1\n", "quantiles do not fall"),
])
def test_a_file_that_is_no_distribution_is_refused(text, message, tmp_path):
    path = tmp_path / "delays.csv"
    path.write_text(text)

    with pytest.raises(RecordingError, match=message):
        Delay(0, "empirical", file=str(path), rng=stream(7, "delay"))


@pytest.mark.parametrize(("settings", "message"), [
    ({"delay_ns": -1}, "delay_ns=-1: expected delay_ns >= 0"),
    ({"jitter_ns": 5}, "jitter_ns=5, correlation=0.0: a constant delay has none: choose distribution = u"),
    ({"distribution": "normal"}, "jitter_ns=0: a normal delay needs jitter_ns > 0"),
    ({"distribution": "gamma", "jitter_ns": 1}, "distribution=gamma: expected constant, uniform"),
    ({"distribution": "normal", "jitter_ns": 1, "correlation": 1.0}, "correlation=1.0: expected -1 < correlation < 1"),
    ({"distribution": "normal", "jitter_ns": 1, "samples_ns": [1]}, "samples_ns: belongs to distribution=empirical"),
    ({"columns": {"delay_ms": "rtt"}}, "these are names in a file, and there is no `file`"),
    ({"distribution": "empirical"}, "empirical with no values: give one of samples_ns, quantiles_ns, file"),
    ({"distribution": "empirical", "samples_ns": [1], "quantiles_ns": [1, 2]}, "give one of"),
    ({"distribution": "empirical", "samples_ns": [-1]}, "samples_ns: -1 is negative"),
    ({"distribution": "empirical", "quantiles_ns": [2, 1]}, "expected two or more values that do not fall"),
    ({"distribution": "empirical", "samples_ns": [1], "jitter_ns": 4}, "an empirical delay has its jitter"),
])
def test_nonsense_is_refused_with_value_and_rule(settings, message):
    with pytest.raises(ValueError, match=message):
        Delay(**settings, rng=stream(7, "delay"))
