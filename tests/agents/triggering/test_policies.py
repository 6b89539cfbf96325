"""What every policy promises, whatever the loop: here an integrator, in tests/agents/tracking the tracking robots."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.triggering.error_gain import KAPPA, error_gain, horizon_s
from agents.triggering.gain_table import GainTable
from agents.triggering.policies import Decision
from agents.triggering.policies.event_triggered import EventTriggered
from agents.triggering.policies.input_output import IndividualGains, UnifiedGain
from agents.triggering.policies.loss_tolerant import LossTolerant
from agents.triggering.policies.periodic import Periodic
from agents.triggering.policies.table import POLICIES, PolicySettings, build_policy
from tests.agents.triggering.integrator import Integrator

GAINS = GainTable({(0.5,): 20.0, (1.5,): 60.0}, unified=90.0)
RADIUS = 5.0
MS = 1_000_000

every_policy = pytest.mark.parametrize("name", sorted(POLICIES.keys() - {"optimal"}))     # that one: test_optimal.py
every_tolerance = pytest.mark.parametrize("losses", [0, 1, 4])


def built(name, losses=0):
    return build_policy(name, Integrator(), GAINS, PolicySettings(max_successive_losses=losses, radius=RADIUS))


@every_tolerance
@every_policy
@given(x=st.floats(-RADIUS, RADIUS), inputs=st.sampled_from([(0.5,), (1.5,), (1.0,), (7.0,)]),
       t_ns=st.integers(0, 10**12))
def test_a_decision_is_certified_for_every_state_that_may_be_reached(name, losses, x, inputs, t_ns):
    decided = built(name, losses).decide(t_ns, x, inputs)

    tau_s = decided.valid_ns * 1e-9
    growth_on_the_set = min(inputs[0], 2.0) * (abs(x) + tau_s)          # retyped: |x| grows by at most 1 per s
    gain = {0.5: 20.0, 1.5: 60.0}.get(inputs[0], 90.0)
    assert gain * error_gain(growth_on_the_set, tau_s) <= KAPPA * (1 + 1e-9)
    assert decided.measured_ns == t_ns
    assert decided.gain_product(decided.holds_until_ns) <= KAPPA * (1 + 1e-9)
    assert 0 < decided.interval_ns <= decided.valid_ns
    assert decided.losses_allowed >= losses
    assert decided.attempt_ns(losses) <= decided.holds_until_ns
    assert decided.next_ns == decided.attempt_ns(0)


@every_policy
def test_a_look_never_shortens_a_decision(name):
    policy = built(name)
    decided = policy.decide(0, 2.0, (1.5,))
    for k, x in enumerate((2.5, 0.1, 0.1, -2.0, 0.0)):
        looked = policy.look((k + 1) * MS, x)

        assert looked.valid_ns >= decided.valid_ns
        assert looked.measured_ns == 0
        decided = looked


@every_policy
def test_no_decision_is_shorter_than_the_bound_against_zeno_behaviour(name):
    policy = built(name)
    zeno_ns = int(IndividualGains(Integrator(), GAINS).shortest_s(RADIUS) * 1e9)

    intervals = [policy.decide(0, x / 10, (w,)).interval_ns for x in range(-50, 51) for w in (0.5, 1.5, 3.0)]

    assert min(intervals) >= zeno_ns > 0


def test_individual_gains_wait_as_long_as_the_inputs_allow():
    policy = IndividualGains(Integrator(), GAINS)

    slow, fast, unknown = (policy.decide(0, 1.0, (w,)) for w in (0.5, 1.5, 1.0))

    assert (slow.gain_per_s, fast.gain_per_s, unknown.gain_per_s) == (20.0, 60.0, 90.0)
    assert slow.valid_ns > 2.9 * fast.valid_ns
    assert slow.valid_ns * 1e-9 < KAPPA / 20


def test_the_unified_gain_does_not_look_at_the_inputs():
    policy = UnifiedGain(Integrator(), GAINS)

    decisions = {policy.decide(0, 1.0, (w,)) for w in (0.5, 1.5, 1.0)}

    assert len(decisions) == 1
    assert decisions.pop().valid_ns < IndividualGains(Integrator(), GAINS).decide(0, 1.0, (1.5,)).valid_ns


def test_states_near_the_origin_may_wait_longer():
    policy = IndividualGains(Integrator(), GAINS)

    taus = [policy.decide(0, x, (0.5,)).valid_ns for x in (0.0, 0.5, 1.0, 2.0, 4.0)]

    assert all(near > far for near, far in pairwise(taus))


def test_a_period_is_the_horizon_of_the_worst_state_within_its_radius():
    policy = Periodic(IndividualGains(Integrator(), GAINS), RADIUS)

    decided = policy.decide(0, 0.0, (0.5,))

    worst = IndividualGains(Integrator(), GAINS).decide(0, RADIUS, (9.0,))      # clipped to the worst inputs, 2
    assert decided.interval_ns == decided.valid_ns == pytest.approx(worst.valid_ns, rel=1e-4)


def test_a_period_of_ones_own_does_not_change_what_is_certified():
    certified = Periodic(IndividualGains(Integrator(), GAINS), RADIUS).period_ns

    decided = Periodic(IndividualGains(Integrator(), GAINS), RADIUS, period_ns=3 * certified).decide(0, 0.0, (0.5,))

    assert (decided.interval_ns, decided.valid_ns) == (3 * certified, certified)
    assert decided.losses_allowed == -1


def test_constant_monitoring_waits_longer_where_the_state_shrinks_after_all():
    policy = EventTriggered(IndividualGains(Integrator(), GAINS), MS)
    predicted = policy.decide(0, 0.0, (1.5,)).valid_ns
    for k in range(1, 17):                      # it stays at 0, where it was feared to leave at 1 per s
        seen = policy.look(k * MS, 0.0)

    elapsed_s = 0.016
    true_growth = 1.5 * 0.001                   # between two looks it might have left, at most
    ideal_ns = horizon_s(true_growth, 60.0) * 1e9
    assert predicted < seen.valid_ns < ideal_ns
    assert seen.valid_ns > elapsed_s * 1e9


@given(st.lists(st.floats(-1, 1), min_size=1, max_size=15))
def test_what_a_look_certifies_covers_all_that_was_seen_and_all_that_may_come(steps):
    policy = EventTriggered(IndividualGains(Integrator(), GAINS), MS)
    x = largest = 1.0
    policy.decide(0, x, (1.5,))
    for k, u in enumerate(steps, start=1):      # one step of the true plant between two looks
        x += u * 1e-3
        largest = max(largest, abs(x))
        seen = policy.look(k * MS, x)

    tau_s = seen.valid_ns * 1e-9
    worst = max(largest, abs(x) + tau_s - len(steps) * 1e-3)
    assert 60.0 * error_gain(1.5 * worst, tau_s) <= KAPPA * (1 + 1e-9)


def test_with_as_many_losses_as_allowed_the_next_success_is_in_time_and_with_one_more_it_is_not():
    for losses in range(6):
        decided = LossTolerant(IndividualGains(Integrator(), GAINS), losses).decide(0, 1.0, (0.5,))

        assert decided.attempt_ns(losses) <= decided.holds_until_ns < decided.attempt_ns(losses + 1)
        assert decided.losses_allowed == losses


@pytest.mark.parametrize("losses", [1, 2, 5])
def test_the_printed_rule_for_losses_comes_too_late(losses):
    """Remark 6 divides by N^D: after N^D losses the attempt that arrives is the one after them."""
    decided = IndividualGains(Integrator(), GAINS).decide(0, 1.0, (0.5,))
    printed = decided._replace(interval_ns=decided.valid_ns // losses)

    assert printed.attempt_ns(losses) > printed.holds_until_ns
    assert printed.gain_product(printed.attempt_ns(losses)) > KAPPA


def test_products_of_gains_start_at_zero_and_pass_kappa_at_the_end():
    decided = Decision(1000, 20 * MS, 20 * MS, 50.0, 0.0)

    assert decided.gain_product(1000) == decided.gain_product(0) == 0.0
    assert decided.gain_product(1000 + 20 * MS) == pytest.approx(1.0)          # growth 0: gain times age


@pytest.mark.parametrize(("make", "said"), [
    (lambda: IndividualGains(Integrator(), GAINS, kappa=1.0), r"kappa=1\.0: expected 0 < kappa < 1"),
    (lambda: IndividualGains(Integrator(), GainTable({}, 1e7)), r"the gain 1e\+07 1/s makes the horizon .* lower the"),
    (lambda: Periodic(IndividualGains(Integrator(), GAINS), -1.0), r"radius=-1\.0"),
    (lambda: Periodic(IndividualGains(Integrator(), GAINS), 1.0, 0), "period_ns=0: expected 1 or more"),
    (lambda: EventTriggered(IndividualGains(Integrator(), GAINS), 0), "watch_ns=0"),
    (lambda: LossTolerant(IndividualGains(Integrator(), GAINS), -1), "max_successive_losses=-1"),
    (lambda: build_policy("psychic", Integrator(), GAINS), "policy='psychic': expected one of individual_gains, "),
])
def test_policies_that_cannot_be_are_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()


def test_gains_are_found_by_inputs_that_went_through_a_frame():
    table = GainTable({(0.6, 0.15): 22.0}, unified=96.0)

    assert table.gain((0.6000000238418579, 0.15000000596046448)) == 22.0          # float32 of both
    assert table.gain((0.61, 0.15)) == 96.0
    assert (table.planned((0.6, 0.15)), table.planned((0.6, 0.16))) == (True, False)


@pytest.mark.parametrize(("gains", "unified", "said"), [
    ({(1.0,): -1.0}, 96.0, r"gains\[\(1\.0,\)\]=-1\.0: expected a positive, finite gain"),
    ({}, float("inf"), "unified=inf"), ({}, float("nan"), "unified=nan"),
    ({(1.0,): 100.0}, 96.0, r"unified=96\.0: expected the largest gain of all inputs")])
def test_gains_that_cannot_be_are_refused(gains, unified, said):
    with pytest.raises(ValueError, match=said):
        GainTable(gains, unified)
