"""The no-escape theorem on the emulator, as stated: over seeds, in continuous time, with and without its margin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from experiments.judge.campaign import Row
from experiments.judge.campaign_rates import holds, rates
from experiments.judge.figures import Figures
from experiments.judge.run_data import RunData, load_run
from experiments.run.figures import Repeated
from experiments.run.node_host import HostName
from experiments.run.runner import run
from experiments.scenario import ScenarioError, find, load
from experiments.sweep.campaign import Wanted, sweep
from experiments.sweep.messages import Point, Source
from experiments.sweep.workers import Workers

SURE, PRINTED = "free_pursuer_chases_runner", "free_pursuer_chases_runner_broken"
MARGIN, VIOLATIONS = "guarantee.no_escape.margin_m", "guarantee.no_escape.violations"
ESTIMATOR = "agents.pursuer.parameters.estimator"
BETWEEN_M = 2.7 * 0.01 / 2              # what the bound between two samples may take off: closing speed, sample period
RADIUS_M = 2.3
HOSTS: tuple[HostName, ...] = ("inline", "process")


def of_seeds(name: str, seeds: range) -> list[Figures]:
    with Workers(Source.of(find(name)), "inline", 2) as workers:
        return [figures for _, figures in workers.evaluate(Point(seed, {}, seed) for seed in seeds)]


def test_with_the_margin_of_the_theorem_no_seed_has_an_escape() -> None:
    found = of_seeds(SURE, range(5))

    assert [one.failure for one in found] == [""] * 5
    assert [one.values[VIOLATIONS] for one in found] == [0.0] * 5
    assert min(one.values[MARGIN] or 0.0 for one in found) > 0
    assert len({one.ledger_hash for one in found}) == 5


def test_with_the_printed_margin_the_runner_escapes_every_time() -> None:
    found = of_seeds(PRINTED, range(3))

    assert [one.failure for one in found] == [""] * 3
    assert max(one.values[MARGIN] or 0.0 for one in found) < -BETWEEN_M     # outside at a sample, not only by the bound


@pytest.mark.slow
@pytest.mark.parametrize(("name", "escapes"), [(SURE, 0), (PRINTED, 1000)])
def test_over_a_thousand_seeds(name: str, escapes: int, tmp_path: Path) -> None:
    """The sweep of docs/models/pursuit.md; 400 s of processor time each."""
    swept = sweep(Wanted(Source.of(find(name)), seeds=1000, folders=0, out=tmp_path / "c"))

    rows: list[Row] = list(swept.campaign.rows)
    found = sum((row.figures.values[MARGIN] or 0.0) < 0 for row in rows)
    assert (len(rows), found) == (1000, escapes)
    interval = binomtest(found, 1000).proportion_ci(0.95, method="exact")
    assert interval.high < 0.0037 if escapes == 0 else interval.low > 0.9963


@pytest.mark.slow
def test_two_pursuers_show_the_shares_that_their_scenario_states(tmp_path: Path) -> None:
    """600 s of processor time."""
    swept = sweep(Wanted(Source.of(find("two_p3at_chase_rovio")), seeds=200, first_seed=1, folders=0,
                         out=tmp_path / "c"))

    of_key = {rate.key: rate for rate in rates(swept.campaign)}
    assert of_key[VIOLATIONS].kept == 191
    assert holds(swept.campaign)


def recorded(out: Path, *overrides: str) -> RunData:
    run(load(find(SURE), duration_s=12.0, overrides=overrides), host="inline", out=out, report=False)
    return load_run(out)


def distances_m(data: RunData) -> np.ndarray:
    evader, pursuer = data.signals["evader"], data.signals["pursuer"]
    return RADIUS_M - np.hypot(evader.column("x") - pursuer.column("x"), evader.column("y") - pursuer.column("y"))


def test_the_distance_judged_is_a_bound_of_the_exact_one_in_continuous_time(tmp_path: Path) -> None:
    """Velocities change at multiples of 10 ms only, so between samples the relative path is a line, along which the
    distance of both is convex: it is largest, and that to the boundary least, at a sample. Samples every 1 ms confirm
    that there is no less in between."""
    data, fine = recorded(tmp_path / "a"), recorded(tmp_path / "b", "sample_period_ms=1")

    exact_m = distances_m(data).min()
    margin_m = data.guarantees["no_escape"].standing.margin
    assert len(distances_m(fine)) > 9 * len(distances_m(data))
    assert distances_m(fine).min() == pytest.approx(exact_m, abs=1e-9)
    assert margin_m is not None
    assert exact_m - BETWEEN_M <= margin_m <= exact_m


def test_between_looks_it_drives_straight_to_the_newest_detection_and_not_beyond(tmp_path: Path) -> None:
    data = recorded(tmp_path / "a")

    table = data.signals["pursuer"]
    place = np.stack([table.column("x"), table.column("y")], axis=1)
    to = np.stack([table.column("detection_x"), table.column("detection_y")], axis=1) - place
    same = np.all(np.diff(to + place, axis=0) == 0, axis=1)             # no detection between two samples
    way = np.hypot(*to.T)
    assert same.sum() > 500
    assert np.all(np.diff(way)[same] <= 1e-12)                           # never recedes
    assert (np.hypot(*np.diff(place, axis=0).T) > 1e-4).sum() > 300      # but moves


@pytest.mark.parametrize("estimator", [*(pytest.param(name, marks=pytest.mark.slow) for name in ("circle", "ukf")),
                                       "particle"])
def test_it_holds_with_each_estimator_and_a_run_repeats(estimator: str) -> None:
    repeated = Repeated(lambda seed: load(find(SURE), seed=seed, duration_s=20.0,
                                          overrides=[f"{ESTIMATOR}='{estimator}'", "expect={}"]), "inline")

    one, again, other = repeated.run(3), repeated.run(3), repeated.run(4)

    assert [figures.values[VIOLATIONS] for figures in (one, again, other)] == [0.0] * 3
    assert one.ledger_hash == again.ledger_hash != other.ledger_hash


@pytest.mark.slow
def test_a_robot_with_particles_has_the_same_ledger_and_estimates_on_both_hosts(tmp_path: Path) -> None:
    found = []
    for host in HOSTS:
        scenario = load(find("p3at_chases_p3at"), duration_s=8.0, overrides=[f"{ESTIMATOR}='particle'"])
        summary = run(scenario, host=host, out=tmp_path / host, report=False).summary
        found.append((summary.ledger_hash, load_run(tmp_path / host).signals["pursuer"].column("estimate_x").tolist()))

    (one, here), (other, there) = found
    assert one == other
    assert np.array_equal(here, there, equal_nan=True)
    assert len(set(here[100:])) > 500                                    # it moves between detections


@pytest.mark.parametrize(("name", "override", "says"), [
    (SURE, "agents.pursuer.parameters.escape_m=0.147", "escape_m=0.147: a target of 0.7 m/s, seen with sigma = 0.1 m, "
     "can get out between two looks; take 0.555 m or more"),
    (SURE, "agents.pursuer.parameters.latency_ms=9", "answer of media.view is applied 10000000 ns after its exposur"),
    (SURE, "media.view.latency_ms=11", "latency_ns=10000000: an answer of media.view is applied 80000000 ns after its"),
    (SURE, "agents.pursuer.parameters.estimator='kalman'", 'estimator="kalman": expected one of circle, ukf, particle'),
    (SURE, "agents.pursuer.parameters.view='sight'", "agents.pursuer.media: lacks sight; it has view, spy"),
    ("p3at_chases_p3at", "agents.evader.parameters.motion='free_runner'",
     "agents.evader.media: a runner sees its pursuer on a medium 'spy'"),
    ("p3at_chases_p3at", "agents.pursuer.parameters={target='evader', radius_m=3.0, no_moving_m=0.6, escape_m=1.5, "
     "latency_ms=210, estimator='ukf', sigma_m=0.0}", "sigma_m=0.0: a Bayesian filter needs a noise of more than 0"),
    ("hummingbird_chases_rovio", "agents.companion.parameters.pursuit.estimator='x'", "expected one of circle, ukf"),
])
def test_what_cannot_work_is_refused_before_the_start(name: str, override: str, says: str) -> None:
    with pytest.raises(ScenarioError) as error:
        load(find(name), overrides=[override])

    assert says in str(error.value)
