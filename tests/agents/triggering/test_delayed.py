"""Looks that take a known time: the interval of a trigger is shorter by that time."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.tracking.controller import Inputs
from agents.tracking.error_system import TrackingErrorSystem
from agents.tracking.section_4_6 import GAINS
from agents.triggering.assumptions import Assumption, delay_violations, violations
from agents.triggering.gain_table import GainTable
from agents.triggering.policies.delayed import Delayed
from agents.triggering.policies.input_output import IndividualGains
from agents.triggering.policies.table import POLICIES, PolicySettings, build_policy
from tests.agents.triggering.integrator import Integrator

MS = 1_000_000
INTEGRATOR_GAINS = GainTable({(0.5,): 20.0, (1.5,): 60.0}, unified=90.0)


def at_1_1(delay_ms):
    policy = build_policy("individual_gains", TrackingErrorSystem(), GAINS,
                          PolicySettings(delay_ns=int(delay_ms * MS), floor_ns=273_000))
    return policy.decide(0, (0.0, 0.0, 0.0), Inputs(1.0, 1.0))


@pytest.mark.parametrize("delay_ms", [5, 10, 17])
def test_at_1_1_a_delay_below_tau_leaves_tau_less_the_delay(delay_ms):
    decided = at_1_1(delay_ms)

    assert decided.valid_ns == pytest.approx(18.405 * MS, rel=0.01)
    assert decided.interval_ns == decided.valid_ns - delay_ms * MS
    assert delay_violations(decided) == []


@pytest.mark.parametrize("delay_ms", [18.2, 19])
def test_a_delay_that_leaves_less_than_a_look_s_frames_is_a_violation_that_is_known_at_once(delay_ms):
    decided = at_1_1(delay_ms)

    (found,) = delay_violations(decided)

    assert (found.assumption, found.at_ns) == (Assumption.FRESH, decided.valid_ns)
    assert (found.value, found.limit) == (delay_ms / 1000, pytest.approx(0.018405, rel=0.01))


def test_at_1_1_a_delay_of_19_ms_leaves_nothing_and_its_age_is_a_violation():
    decided = at_1_1(19)

    assert decided.interval_ns == decided.valid_ns          # not 0: a robot would ask without end
    assert [each.assumption for each in violations(decided, 19 * MS)] == [Assumption.FRESH, Assumption.SMALL_GAIN]


@pytest.mark.parametrize("name", sorted(POLICIES.keys() - {"optimal"}))       # that needs tables: test_optimal
@given(x=st.floats(-5, 5), inputs=st.sampled_from([(0.5,), (1.5,), (1.0,)]), losses=st.integers(0, 3),
       delay_ns=st.integers(1, 12 * MS))
def test_the_oldest_measurement_that_acts_is_within_tau(name, x, inputs, losses, delay_ns):
    plain = build_policy(name, Integrator(), INTEGRATOR_GAINS, PolicySettings(max_successive_losses=losses, radius=5.0))
    delayed = Delayed(plain, delay_ns)

    decided, before = delayed.decide(0, x, inputs), plain.decide(0, x, inputs)

    oldest_ns = (losses + 1) * decided.interval_ns + delay_ns       # `losses` requests fail, the next one acts
    assert decided.valid_ns == before.valid_ns
    if before.valid_ns - delay_ns >= losses + 1:
        assert oldest_ns <= decided.valid_ns
        assert decided.losses_allowed >= losses
        assert decided.interval_ns <= before.interval_ns
    else:
        assert decided.interval_ns == before.interval_ns


def test_an_interval_shorter_than_a_look_s_frames_is_none():
    decided = Delayed(IndividualGains(Integrator(), INTEGRATOR_GAINS), 10 * MS, floor_ns=8 * MS).decide(0, 0.0, (1.5,))

    assert 10 * MS < decided.valid_ns < 18 * MS
    assert decided.interval_ns == decided.valid_ns


def test_a_negative_delay_is_refused():
    with pytest.raises(ValueError, match="delay_ns=-1"):
        Delayed(IndividualGains(Integrator(), INTEGRATOR_GAINS), -1)
