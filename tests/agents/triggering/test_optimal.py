"""The policy `optimal`: decisions from a table of intervals; clamped states, inputs without a table, and losses."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.optimal_triggering.averager import Grid, symmetric, values
from agents.tracking.controller import Inputs
from agents.tracking.error_system import TrackingErrorSystem
from agents.tracking.section_4_6 import GAINS
from agents.triggering.assumptions import Assumption, table_violations
from agents.triggering.error_gain import KAPPA
from agents.triggering.policies.interval_table import IntervalTable
from agents.triggering.policies.table import PolicySettings, build_policy

AXES = [symmetric(0.5, 2.0, 8.0), symmetric(1.0, 8.0), symmetric(0.5, 3.0)]
GRID = Grid(*AXES)
RNG = np.random.default_rng(0)
CAP_S = 0.3 + 0.5 * RNG.random(GRID.points.shape[1])
TAU_S = CAP_S * RNG.uniform(0.1, 1.0, CAP_S.size)
HELD = Inputs(1.0, 1.0)
some_state = st.tuples(*[st.floats(-12, 12)] * 3)


def table(tau_s=TAU_S, cap_s=CAP_S, shortest_s=0.01):
    return IntervalTable([axis.tolist() for axis in AXES], tau_s.tolist(), cap_s.tolist(), shortest_s)


def policy(losses=0):
    return build_policy("optimal", TrackingErrorSystem(), GAINS,
                        PolicySettings(max_successive_losses=losses, tables={HELD: table()}))


@given(x=some_state)
def test_an_interval_is_interpolated_and_stays_below_every_cap_of_its_cell(x):
    found = table().look_up(x)

    at = np.array(x)[:, None]
    combined = GRID.combine(at)
    least = CAP_S[combined.points[combined.weights[:, 0] > 0]].min()
    assert found.cap_s <= least
    assert found.tau_s == pytest.approx(min(max(values(GRID, TAU_S, at)[0], 0.01), found.cap_s))
    assert found.clamped == any(abs(each) > axis[-1] for each, axis in zip(x, AXES, strict=True))


@given(x=some_state)
def test_a_decision_holds_until_its_cap(x):
    decided = policy().decide(10**9, x, HELD)

    assert 0 < decided.interval_ns <= decided.valid_ns
    assert decided.gain_product(decided.holds_until_ns) == pytest.approx(KAPPA)
    assert decided.gain_product(10**9 + int(1.01 * decided.valid_ns)) > 1


@given(x=some_state, losses=st.integers(1, 4))
def test_requests_that_may_be_lost_all_fit_below_the_cap(x, losses):
    decided = policy(losses).decide(0, x, HELD)

    assert decided.attempt_ns(losses) <= decided.holds_until_ns
    assert decided.interval_ns <= policy().decide(0, x, HELD).interval_ns


def test_a_state_outside_is_clamped_and_told():
    inside, outside = policy().decide(0, (8.0, 0.0, 0.0), HELD), policy().decide(0, (80.0, 0.0, 0.0), HELD)

    assert (inside.clamped, outside.clamped) == (False, True)
    assert inside.interval_ns == outside.interval_ns
    (told,) = table_violations(outside, (80.0, 0.0, 0.0))
    assert told.assumption is Assumption.TABLE
    assert str(told) == "table of intervals: x = (80, 0, 0) is outside of it and clamped to its edge"
    assert table_violations(inside, (8.0, 0.0, 0.0)) == []


def test_inputs_without_a_table_are_triggered_by_the_gains():
    individual = build_policy("individual_gains", TrackingErrorSystem(), GAINS)

    for inputs in (Inputs(0.6, 0.15), Inputs(2.5, -1.0)):
        assert policy().decide(5, (1.0, 0.0, 0.0), inputs) == individual.decide(5, (1.0, 0.0, 0.0), inputs)
    assert policy().decide(5, (1.0, 0.0, 0.0), Inputs(1.0 + 1e-7, 1.0)) == policy().decide(5, (1.0, 0.0, 0.0), HELD)


@pytest.mark.parametrize("x", [(float("nan"), 0.0, 0.0), (0.0, float("inf"), 0.0), (0.0, 0.0, float("-inf"))])
def test_what_is_no_state_is_refused(x):
    with pytest.raises(ValueError, match="no tracking error"):
        policy().decide(0, x, HELD)


def test_a_cap_below_the_shortest_interval_is_refused():
    with pytest.raises(ValueError, match=r"shortest_s=0.4: .* at most the least cap"):
        table(shortest_s=0.4)


def test_a_policy_without_a_table_is_refused():
    with pytest.raises(ValueError, match="has no table of intervals"):
        build_policy("optimal", TrackingErrorSystem(), GAINS)
