"""Tables of the policy `optimal`: caps that hold between grid points, and the pure loop with them."""

from itertools import pairwise
from random import Random

import numpy as np
import pytest

from agents.tracking.closed_loop import run
from agents.tracking.controller import Inputs
from agents.tracking.error_system import LIMITS, TrackingErrorSystem
from agents.tracking.noise import Noise
from agents.tracking.optimal_settings import OptimalSettings, read_optimal
from agents.tracking.optimal_tables import cap_problems, make_tables
from agents.tracking.section_4_6 import GAINS, REFERENCE
from agents.triggering.assumptions import violations
from agents.triggering.policies.input_output import IndividualGains
from agents.triggering.policies.interval_table import IntervalTable
from agents.triggering.policies.table import PolicySettings, build_policy

SECOND = 10**9
GRID = {"x_m": (0.2, 0.8, 3.0, 8.0), "heading_rad": (0.4, 3.14), "candidates": 8}


def tables(look_cost_j=1.5e-4, **settings):
    steps = []
    made = make_tables(OptimalSettings(**GRID, **settings), GAINS, look_cost_j, lambda: steps.append(1))
    assert len(steps) == 9
    return {Inputs(*each["inputs"]): IntervalTable(each["axes"], each["tau_s"], each["cap_s"], each["shortest_s"])
            for each in made.by_inputs}, made.remark


def policy(made):
    return build_policy("optimal", TrackingErrorSystem(limits=LIMITS), GAINS, PolicySettings(tables=made))


def test_with_the_printed_cap_no_interval_is_longer_than_is_certified():
    made, _ = tables(cap="printed")
    trigger = IndividualGains(TrackingErrorSystem(limits=LIMITS), GAINS)
    states = np.random.default_rng(0).uniform(-1, 1, (500, 3)) * (8.0, 8.0, 3.14)

    for x in states.tolist():
        for inputs, table in made.items():
            certified_ns = trigger.decide(0, tuple(x), inputs).valid_ns
            assert table.look_up(x).cap_s * 1e9 <= 1.01 * certified_ns


def test_what_the_policy_promises_holds_at_every_instant_of_a_run():
    made, remark = tables()

    done = run(policy(made), REFERENCE, (1.0, 1.0, 0.5), 3 * SECOND, noise=Noise(Random(0), Random(1)))

    assert remark == ""
    for before, after in pairwise(done.transmissions):
        assert violations(before.decision, after.t_ns) == []
    intervals = {sent.decision.interval_ns for sent in done.transmissions}
    assert len(intervals) > 5
    assert done.rms(2 * SECOND, 3 * SECOND) < 0.5


def test_intervals_grow_with_the_cost_of_a_look():
    at_rest = [tables(look_cost_j)[0][Inputs(1.0, 1.0)].look_up((0.0, 0.0, 0.0)).tau_s
               for look_cost_j in (1e-4, 1e-3, 1e-1)]

    assert at_rest[0] < at_rest[1] < at_rest[2]


def test_a_cap_below_the_shortest_interval_is_found_without_a_table():
    assert cap_problems(OptimalSettings(**GRID), GAINS) == []
    found = cap_problems(OptimalSettings(**GRID, cap="printed", shortest_ms=16.0), GAINS)

    assert [line.split(" is ")[0] for line in found] == ['team.optimal.shortest_ms=16: the cap "printed"'] * 2


def test_all_mistakes_of_the_table_are_told_at_once():
    with pytest.raises(ValueError) as refused:
        read_optimal({"optimal": {"shortest_ms": 0.0, "x_m": [1.0, 0.5], "candidates": 100}})

    assert [line.partition("=")[0] for line in str(refused.value).split("; ")] == [
        "team.optimal.shortest_ms", "team.optimal.x_m", "team.optimal.candidates"]


def test_a_constant_interval_is_kept_within_shortest_and_cap():
    made = make_tables(OptimalSettings(**GRID, constant_ms=100.0, cap="regional"), GAINS, 1e-4)

    assert made.remark.startswith("constant_ms=100: ")
    for table in made.by_inputs:
        assert table["tau_s"] == [min(0.1, cap) for cap in table["cap_s"]]
