"""Gains that count in a region: used inside, not outside, and a state that has left it is told."""

import pytest

from agents.triggering.assumptions import Assumption, region_violations
from agents.triggering.gain_table import GainTable, RegionalGain
from agents.triggering.policies.regional_gains import RegionalGains
from tests.agents.triggering.integrator import Integrator

GAINS = GainTable({(0.5,): 20.0, (1.5,): 60.0}, unified=90.0, regional={(0.5,): RegionalGain(4.0, 1.0)})


class Noisy(Integrator):
    def largest_norm(self, x: float) -> float:
        return abs(x) + 0.3


@pytest.mark.parametrize(("x", "inputs", "gain", "radius"), [
    (0.7, (0.5,), 4.0, 1.0), (-0.7, (0.5,), 4.0, 1.0), (0.71, (0.5,), 20.0, float("inf")),
    (0.0, (1.5,), 60.0, float("inf")), (0.0, (1.0,), 90.0, float("inf"))])
def test_a_gain_counts_where_every_state_that_can_be_measured_so_is_in_its_region(x, inputs, gain, radius):
    policy = RegionalGains(Noisy(), GAINS)

    decided = policy.decide(7, x, inputs)

    assert (decided.gain_per_s, decided.radius) == (gain, radius)
    assert decided.gain_product(decided.holds_until_ns) <= 0.9991
    assert policy.look(8, x) is decided


def test_a_state_outside_the_region_of_the_last_gain_is_a_violation_and_one_outside_of_no_region_is_none():
    policy = RegionalGains(Noisy(), GAINS)
    inside, outside = policy.decide(0, 0.1, (0.5,)), policy.decide(0, 3.0, (0.5,))

    found, = region_violations(9, (1.4, 0.0), inside, noise=0.2)

    assert found.assumption is Assumption.REGION
    assert (found.at_ns, found.value, found.limit) == (9, 1.4, pytest.approx(1.0 + 0.2 * 2**0.5))
    assert str(found) == "region of the gain: |x| = 1.4, the gain 4 1/s counts up to 1"
    assert region_violations(9, (1.2, 0.0), inside, noise=0.2) == []        # noise may have made it so
    assert region_violations(9, (9.0, 0.0), outside) == region_violations(9, (9.0, 0.0), None) == []


@pytest.mark.parametrize("row", [(0.0, 1.0), (-1.0, 1.0), (91.0, 1.0), (4.0, 0.0), (float("nan"), 1.0)])
def test_a_row_that_is_none_is_refused(row):
    with pytest.raises(ValueError, match=r"regional\[\(0\.5,\)\]=.*: expected a gain above 0, at most the unified one"):
        GainTable({(0.5,): 20.0}, 90.0, regional={(0.5,): RegionalGain(*row)})
