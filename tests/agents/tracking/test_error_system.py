from math import inf, nan, sqrt
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.tracking.closed_loop import run
from agents.tracking.controller import Inputs, TrackingController
from agents.tracking.error_bound import Bound, ErrorBound
from agents.tracking.error_system import TrackingErrorSystem
from agents.tracking.noise import Noise
from agents.tracking.reachable_set import extents_until
from agents.tracking.section_4_6 import GAINS, REFERENCE, START
from agents.triggering.error_gain import KAPPA, error_gain
from agents.triggering.policies.event_triggered import EventTriggered
from agents.triggering.policies.input_output import IndividualGains, UnifiedGain
from agents.triggering.policies.periodic import Periodic

SYSTEM = TrackingErrorSystem()
states = st.tuples(*[st.floats(-6, 6)] * 3)


@given(states, st.sampled_from([Inputs(0.6, 0.15), Inputs(1.0, 1.0), Inputs(2.0, 2.0), Inputs(-1.0, 0.5)]))
def test_a_prediction_is_the_bound_on_the_set_that_its_command_reaches(x, inputs):
    prediction = SYSTEM.predict(x, inputs, inputs)

    command = TrackingController().command(x, inputs)
    assert prediction.command == command
    for tau_s in (0.0, 0.01, 0.04):
        extents = extents_until(x, command, Inputs(3.0, 3.0), 0.15)(tau_s)
        assert prediction.growth_until(tau_s) == ErrorBound(TrackingController()).growth_per_s(inputs.v_mps, extents)


@given(states, st.sampled_from(list(Bound)), st.floats(-3, 3), st.floats(-3, 3))
def test_a_decision_meets_the_small_gain_condition_on_its_set_and_could_not_be_longer(x, bound, v, omega):
    system = TrackingErrorSystem(bound=bound)
    inputs = Inputs(v, omega)
    policy = IndividualGains(system, GAINS)

    decided = policy.decide(0, x, inputs)

    growth_until = system.predict(x, inputs, inputs).growth_until
    gain, tau_s = GAINS.gain(inputs), decided.valid_ns * 1e-9
    assert gain * error_gain(growth_until(tau_s), tau_s) <= KAPPA * (1 + 1e-9)
    longer = tau_s + 3e-5 * KAPPA / gain
    slack = 1e-4 if bound in (Bound.PRINTED, Bound.CLOSED_FORM) else 2e-3      # steps of a13's table
    assert gain * error_gain(growth_until(longer), longer) > KAPPA * (1 - slack)


@given(states, st.floats(-3, 3), st.floats(-3, 3))
def test_no_state_within_the_radius_has_a_shorter_horizon_than_the_zeno_bound(x, v, omega):
    radius = sqrt(sum(a * a for a in x))
    nu = 0.15 * np.sign(x)
    for policy in (IndividualGains(SYSTEM, GAINS), UnifiedGain(SYSTEM, GAINS)):
        decided = policy.decide(0, tuple(x + nu), Inputs(v, omega))

        assert decided.valid_ns >= int(policy.shortest_s(radius) * 1e9)
        assert decided.valid_ns * 1e-9 <= KAPPA / decided.gain_per_s


def test_a_look_replaces_what_was_feared_by_what_is_seen():
    prediction = SYSTEM.predict((2.0, 2.0, 0.5), Inputs(2.0, 2.0), Inputs(2.0, 2.0))
    feared = prediction.growth_until(0.02)

    prediction.look(0.01, (1.9, 1.9, 0.45))

    bound = ErrorBound(TrackingController())
    first = extents_until((2.0, 2.0, 0.5), prediction.command, Inputs(3.0, 3.0), 0.15)(0.01)
    then = extents_until((1.9, 1.9, 0.45), prediction.command, Inputs(3.0, 3.0), 0.15)(0.01)
    both = tuple(max(a, b) for a, b in zip(first, then, strict=True))
    assert prediction.growth_until(0.02) == bound.growth_per_s(2.0, both) < feared
    prediction.look(0.015, (0.5, 0.5, 0.1))                 # what was seen before is not forgotten
    assert prediction.growth_until(0.015) >= bound.growth_per_s(2.0, first)


@pytest.mark.parametrize(("inputs", "nearest"), [
    ((1.0, 1.0), (1.0, 1.0)), ((3.2, -3.4), (3.0, -3.0)), ((0.0, 17.0), (0.0, 3.0)), ((-inf, 0.0), (-3.0, 0.0))])
def test_inputs_outside_p_are_replaced_by_the_nearest_inside(inputs, nearest):
    assert SYSTEM.admissible(Inputs(*inputs)) == nearest


@pytest.mark.parametrize("x", [(nan, 0.0, 0.0), (0.0, inf, 0.0), (0.0, 0.0, -1e7)])
def test_what_is_no_tracking_error_is_refused_and_leaves_the_policy_as_it_was(x):
    policy = EventTriggered(IndividualGains(SYSTEM, GAINS))
    before = policy.decide(0, (1.0, 1.0, 0.0), Inputs(1.0, 1.0))

    with pytest.raises(ValueError, match=r"x=.*no tracking error \[m, m, rad\]; leave such a measurement out"):
        policy.decide(5, x, Inputs(1.0, 1.0))
    with pytest.raises(ValueError, match="no tracking error"):
        policy.look(6, x)
    assert policy.look(7_000_000, (1.0, 1.0, 0.0)).measured_ns == before.measured_ns


@pytest.mark.parametrize("policy", [UnifiedGain(SYSTEM, GAINS), Periodic(IndividualGains(SYSTEM, GAINS), 10.0)],
                         ids=["unified", "periodic"])
def test_a_policy_with_one_gain_or_one_period_refuses_what_is_no_tracking_error_too(policy):
    with pytest.raises(ValueError, match="no tracking error"):
        policy.decide(5, (0.0, nan, 0.0), Inputs(1.0, 1.0))


def test_inputs_that_are_no_numbers_are_refused():
    with pytest.raises(ValueError, match=r"inputs=\(nan, 0\.0\): not a number; leave such a measurement out"):
        IndividualGains(SYSTEM, GAINS).decide(0, (0.0, 0.0, 0.0), Inputs(nan, 0.0))


@pytest.mark.parametrize(("settings", "said"), [
    ({"noise": -0.1}, r"noise=-0\.1: expected the largest error"), ({"limits": Inputs(0.0, 3.0)}, "limits=Inputs")])
def test_bounds_that_bound_nothing_are_refused(settings, said):
    with pytest.raises(ValueError, match=said):
        TrackingErrorSystem(**settings)


def test_what_is_certified_does_happen_only_if_the_command_is_held():
    """The horizon of a policy belongs to the system's noise: a louder sensor shortens it."""
    quiet, loud = (IndividualGains(TrackingErrorSystem(noise=noise), GAINS).decide(0, (1.0, 1.0, 0.3), Inputs(1.0, 1.0))
                   for noise in (0.0, 0.5))

    assert loud.valid_ns < quiet.valid_ns


def test_the_interfaces_fit():
    made = run(IndividualGains(SYSTEM, GAINS), REFERENCE, START, 10**8, noise=Noise(Random(1), Random(2)))

    assert len(made.transmissions) >= 5
