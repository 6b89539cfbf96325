"""No escape, looked at as the truth: a sample of every kind of run here, all 3 000 of them marked slow."""

from fractions import Fraction
from math import hypot

import numpy as np
import pytest

from agents.estimation.circle_filter import CircleFilter
from agents.estimation.paths import INSTANTS, circular
from agents.pursuit.chase import chase
from agents.pursuit.evaders import OnPath, Runner
from agents.pursuit.law import Area, PursuitLaw
from agents.pursuit.no_escape import least_escape_m
from agents.pursuit.pursuer import Pursuer, adaptive_pursuer
from agents.pursuit.sampling.periodic import Periodic
from agents.pursuit.section_3_3 import (
    CLOSER_ETA_M,
    CLOSER_GAIN_PER_S,
    EVADERS,
    PRINTED_ZETA_M,
    SIGMA_M,
    SURE_ZETA_M,
    TABLE_ZETA_M,
    V_MAX_MPS,
    pursuer,
    run,
)
from agents.pursuit.zones import Zones

STEP_NS = 70_000_000


@pytest.mark.parametrize("evader", EVADERS)
def test_no_target_escapes_where_the_theorem_holds(evader):
    runs = [run(evader, SURE_ZETA_M, seed, sure=True) for seed in range(15)]

    assert [seed for seed, found in enumerate(runs) if found.escaped_ns is not None] == []


@pytest.mark.slow
@pytest.mark.parametrize("evader", EVADERS)
def test_no_target_escapes_in_a_thousand_runs_where_the_theorem_holds(evader):
    escaped = [seed for seed in range(1000) if run(evader, SURE_ZETA_M, seed, sure=True).escaped_ns is not None]

    assert escaped == []


@pytest.mark.parametrize(("evader", "most_looks", "tolerance"), [("circle", 22.6, 0.6), ("zig-zag", 29.2, 1.0)])
def test_keeping_closer_is_sure_with_no_more_looks_than_the_tables_have(evader, most_looks, tolerance):
    runs = [run(evader, SURE_ZETA_M, seed, sure=True, eta_m=CLOSER_ETA_M, gain_per_s=CLOSER_GAIN_PER_S)
            for seed in range(30)]

    looks = np.array([found.looks for found in runs])
    assert [seed for seed, found in enumerate(runs) if found.escaped_ns is not None] == []
    assert looks.mean() <= most_looks + tolerance


@pytest.mark.parametrize("evader", EVADERS)
def test_no_target_escapes_when_answers_come_late_and_the_escape_area_is_wide_enough(evader):
    runs = [run(evader, SURE_ZETA_M + 3 * 0.049, seed, sure=True, latency_steps=3) for seed in range(5)]

    assert [seed for seed, found in enumerate(runs) if found.escaped_ns is not None] == []


@pytest.mark.parametrize(("losses", "latency_steps"), [(1, 0), (3, 0), (2, 2)])
def test_no_target_escapes_when_answers_are_lost_and_the_escape_area_is_wide_enough(losses, latency_steps):
    zeta_m = least_escape_m(V_MAX_MPS, SIGMA_M, STEP_NS, latency_steps * STEP_NS, losses)

    runs = [run("runner", zeta_m, seed, sure=True, latency_steps=latency_steps, losses=losses) for seed in range(8)]

    assert [seed for seed, found in enumerate(runs) if found.escaped_ns is not None] == []


def test_losses_without_room_for_them_let_a_runner_go_every_time():
    """Answers 3 steps late and 3 of 4 lost need 15 steps of 0.049 m more: not even 4.5 sigma make up for them."""
    runs = [run("runner", SURE_ZETA_M, seed, sure=False, latency_steps=3, losses=3) for seed in range(8)]

    assert all(found.escaped_ns is not None for found in runs)


def test_periodic_looks_are_as_many_as_asked_for():
    """17 in 786 instants, the first of them with the two after it counted as one."""
    periodic = Pursuer(CircleFilter(17), Periodic(STEP_NS, Fraction(INSTANTS, 17)), PursuitLaw(),
                       Zones(2.3, 1.15, 0.55), 0.2)
    rng = np.random.default_rng(1)

    found = chase(periodic, (0.0, 0.0), OnPath(circular()), rng, instants=INSTANTS, step_ns=STEP_NS, sigma_m=SIGMA_M)

    assert found.looks == 17


def test_with_the_printed_escape_area_a_target_that_runs_for_the_boundary_escapes_every_time():
    runs = [run("runner", PRINTED_ZETA_M, seed, sure=False) for seed in range(15)]

    assert all(found.escaped_ns is not None for found in runs)


@pytest.mark.parametrize(("evader", "looks", "tolerance"), [("circle", 22.6, 0.6), ("zig-zag", 29.2, 1.0)])
def test_it_takes_no_more_looks_than_tables_3_2_and_3_4_allow(evader, looks, tolerance):
    found = np.array([run(evader, TABLE_ZETA_M, seed, sure=False).looks for seed in range(20)])

    assert found.mean() <= looks + tolerance + 4 * found.std(ddof=1) / 20 ** 0.5


def test_walls_do_not_help_the_target():
    """Both are held by the same area; the target ends in a corner of it."""
    area = Area((-3.0, 3.0), (-3.0, 3.0))
    for seed in range(5):
        rng = np.random.default_rng(seed)
        hunter = pursuer("runner", SURE_ZETA_M, sure=True)
        hunter.law = PursuitLaw(area=area)

        found = chase(hunter, (0.0, 0.0), Runner((0.5, 0.5), V_MAX_MPS, rng, area), rng, instants=300, step_ns=STEP_NS,
                      sigma_m=SIGMA_M, traced=True)

        assert found.escaped_ns is None
        assert all(abs(x) <= 3 and abs(y) <= 3 for step in found.trace for x, y in (step.target, step.own))


def test_asked_rarely_it_looks_and_drives_as_when_asked_at_every_instant():
    """A program that steps one T_s before the look that it was told, and when an answer comes, and at no other time."""
    rng, path = np.random.default_rng((0, 3)), circular()
    noise = SIGMA_M * rng.standard_normal((INSTANTS, 2))
    expected = run("circle", SURE_ZETA_M, 3, sure=True, traced=True)
    hunter, own, looks, steps = pursuer("circle", SURE_ZETA_M, sure=True), (0.0, 0.0), [], 0
    decision = hunter.step(-1, own)

    for k in range(INSTANTS):
        now_ns = k * STEP_NS
        if decision.look_ns == now_ns:
            hunter.asked(now_ns)
            looks.append(k)
            hunter.detected(now_ns, now_ns, (path.x[k] + noise[k, 0], path.y[k] + noise[k, 1]), own)
        if decision.look_ns in (now_ns, now_ns + STEP_NS):
            decision = hunter.step(now_ns, own)
            steps += 1
        if decision.goal:
            own = hunter.law.moved(own, decision.goal, 0.07)

    assert looks == [k for k, step in enumerate(expected.trace) if step.seen is not None]
    assert steps < INSTANTS / 5


def test_the_least_distance_is_the_truths_and_signed():
    """Nobody moves and nobody can see: the target drives on along x, the radius is 2.3 m."""

    class Away(Runner):
        def moved(self, dt_s, hunter):
            self.place = self.place[0] + 0.7 * dt_s, 0.0
            return self.place

    hunter = pursuer("runner", SURE_ZETA_M, sure=True)
    hunter.law = PursuitLaw(u_max_mps=1e-9)
    rng = np.random.default_rng(1)

    found = chase(hunter, (0.0, 0.0), Away((0.0, 0.0), 0.7, rng), rng, instants=101, step_ns=STEP_NS, sigma_m=0.0,
                  traced=True)

    assert found.least_m == pytest.approx(2.3 - 0.7 * 7.0, abs=1e-6)
    assert found.escaped_ns == pytest.approx(2.3 / 0.7 * 1e9, abs=STEP_NS / 5)
    seen_ns = [step.t_ns for step in found.trace if step.seen is not None]
    assert max(seen_ns) <= found.escaped_ns < 101 * STEP_NS


def test_answers_come_as_late_as_they_are_said_to(monkeypatch):
    told, detected = [], Pursuer.detected

    def record(self, now_ns, seen_ns, *rest):
        told.append(now_ns - seen_ns)
        return detected(self, now_ns, seen_ns, *rest)

    monkeypatch.setattr(Pursuer, "detected", record)

    run("zig-zag", SURE_ZETA_M + 3 * 0.049, 1, sure=True, latency_steps=3)

    assert set(told) == {3 * STEP_NS}


def test_a_runner_runs_straight_away_from_where_its_pursuer_is_and_walls_hold_it():
    rng, area = np.random.default_rng(1), Area((-2.0, 2.0), (-2.0, 2.0))
    runner = Runner((1.0, 1.0), 0.7, rng, area)

    assert runner.moved(1.0, (0.0, 1.0)) == pytest.approx((1.7, 1.0))
    assert runner.moved(1.0, (1.7, 5.0)) == pytest.approx((1.7, 0.3))
    assert runner.moved(1.0, (0.7, 0.3)) == pytest.approx((2.0, 0.3))


def test_an_evader_on_a_path_is_where_the_path_is_at_every_instant():
    path = circular()
    evader = OnPath(path)

    for k in range(1, INSTANTS):
        for _ in range(5):
            evader.moved(0.07 / 5, (0.0, 0.0))

        assert hypot(evader.place[0] - path.x[k], evader.place[1] - path.y[k]) < 1e-7


def test_a_run_depends_on_its_seed_only():
    assert run("runner", SURE_ZETA_M, 4, sure=True) == run("runner", SURE_ZETA_M, 4, sure=True)


def test_other_filters_serve_as_well():
    """Section 3.2: the design allows for any filter; the unscented one here, told no inputs."""
    from agents.estimation import Inputs
    from agents.estimation.unscented_kalman import UnscentedKalman

    hunter = pursuer("runner", SURE_ZETA_M, sure=True)
    other = adaptive_pursuer(UnscentedKalman((0.0, 0.0, 0.0), (0.1, 0.1, 0.1), 0, Inputs(0.0, 0.0)), hunter.zones,
                             hunter.law, v_max_mps=V_MAX_MPS, sigma_m=SIGMA_M, step_ns=STEP_NS, rho_m=0.2)
    rng = np.random.default_rng(6)

    found = chase(other, (0.0, 0.0), OnPath(circular()), rng, instants=INSTANTS, step_ns=STEP_NS, sigma_m=SIGMA_M)

    assert found.escaped_ns is None
